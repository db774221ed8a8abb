"""What a law looks at and what its torque does, told from its signal and its response.

Through free ports friction and contact in a gap are one law over different signals. Friction follows the
speed of the axis; the twist of the drive is the torque that it passes on, which accelerates the load. And a
torque accelerates: a friction that moves the reading at once and no further is lost motion between the axis
and its encoder. A ripple repeats within the motion that it looks at.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray, spanned
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.drive_forms import OF_DEMAND
from bayes_hw.gap.joint.forms.joint_forms import AS_SHAPE, AT_ONCE, BY_TWIST, REMEMBERING, TURNS_SEEN
from bayes_hw.gap.joint.response.effect_paths import through_port
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.motion import Motion
from bayes_hw.gap.joint.search.verification import FORM_SHARE
from bayes_hw.identify.cascade_roots import section_poles

ALIKE = 0.8
"""Share of what a law looks at that follows what another one does, where both look at one motion."""

TWISTED, SEEN, FROM_AFAR, LITTLE = 0.1, 0.2, 0.1, 0.5
"""Shares of a signal's variance: that follow the acceleration in a twist, and the speed in a friction and in
one of a part that the reading follows from afar, at least; what follows the acceleration over what follows
the speed: more in a twist, less in a friction."""

FRICTION = "friction"

LAW_LEAD = 15.0
"""Nats by which one law must lead another that is nearly the same curve over the same motion to be told from
it; more where they explain so much that their forms' errors come to more."""

TWISTS = (K.BASE_TWIST, K.BASE_TWIST_RATE)


ACCELERATED = 0.1
"""Of the root mean square of what a torque moves, that passes through lasting poles of G at least."""

LASTING = 0.5
"""Of a pole's radius, from which on it lasts longer than a sample."""


def named_by_sight(fit: AnyFit) -> AnyFit:
    """The fit with laws that look at a twist, those that accelerate nothing, and ripples that do not repeat,
    under the name of what does so; nothing else changes."""
    effects = list(fit.values.effects)
    for number, effect in enumerate(effects):
        if effect.form in BY_TWIST and sees_twist(fit, number):
            adds = effect.form in REMEMBERING and not takes_away(fit, number)
            effects[number] = replace(effect, form=(REMEMBERING if adds else BY_TWIST)[effect.form])
        elif effect.form in AT_ONCE and not accelerates(fit, number):
            effects[number] = replace(effect, form=AT_ONCE[effect.form])
        elif effect.form in AS_SHAPE and turns_seen(fit, number) < TURNS_SEEN:
            effects[number] = replace(effect, form=AS_SHAPE[effect.form])
    if all(new.form is old.form for new, old in zip(effects, fit.values.effects, strict=True)):
        return fit
    return fit.moved(fit.structure, JointValues(fit.values.cascade, tuple(effects)), fit.point.whitener)


def turns_seen(fit: JointFit, number: int) -> float:
    """Periods of the ripple that is effect `number` that the motion it looks at goes through in all
    records: its own motion may go less far than the reading."""
    effect, row = fit.values.effects[number], fit.values.law_row(number)
    runs = [fit.response.along(fit.values, record) for record in range(len(fit.response.records))]
    travel = spanned([run.signals[row] for run in runs])
    return travel * float(effect.values[0]) / (2 * np.pi)


def accelerates(fit: JointFit, number: int) -> bool:
    """Whether more than a trace of what the torque of effect `number` moves passes through poles of G that
    last longer than a sample."""
    effect, row = fit.values.effects[number], fit.values.law_row(number)
    if (ports := effect.ports) is None:
        return False
    cascade = fit.values.cascade
    slow_pairs = [_lasts(section_poles(a1, a2)) for a1, a2 in cascade.sections[:2].T]
    slow = replace(
        ports,
        real=np.where(cascade.real[0] > LASTING, ports.real, 0.0),
        sections=np.where(slow_pairs, ports.sections, 0.0),
        direct=np.zeros(2),
    )
    torques = [fit.response.along(fit.values, n).torques[row] for n in range(len(fit.response.records))]
    whole, passed = (
        np.concatenate(
            [through_port(fit.values, replace(effect, ports=p), torque[None])[0] for torque in torques]
        )
        for p in (ports, slow)
    )
    return float(np.std(passed)) > ACCELERATED * float(np.std(whole))


def _lasts(poles: ComplexArray) -> bool:
    """Whether a pair of poles is of a motion that lasts: it swings, or decays in more than a sample."""
    return bool(abs(poles[0]) > LASTING if poles[0].imag else poles.real.max() > LASTING)


def sees_twist(fit: JointFit, number: int) -> bool:
    """Whether the law of effect `number` looks at a twist, or at its rate."""
    effect = fit.values.effects[number]
    if effect.form.base in TWISTS:
        return True
    if not effect.looks_at_states:
        return False
    by_speed, by_acceleration = shares_of_motion(fit, number)
    return by_acceleration > max(TWISTED, LITTLE * by_speed)


def takes_away(fit: JointFit, number: int) -> bool:
    """Whether effect `number` accelerates the axis against what all else does at that moment: in a gap
    nothing of the drive's torque is passed on, where hysteresis makes a spring the stiffer."""
    alone, by_law = [], []
    for record in range(len(fit.response.records)):
        run = fit.response.along(fit.values, record)
        torque = run.torques[fit.values.law_row(number)]
        moved = through_port(fit.values, fit.values.effects[number], torque[None])[0]
        by_law.append(np.diff(moved, 2))
        alone.append(np.diff(run.w - moved, 2))
    return float(np.concatenate(alone) @ np.concatenate(by_law)) < 0


def is_hidden_friction(fit: JointFit) -> bool:
    """Whether a law over a twist or its rate, or of what the drive asks for, looks at the speed of the axis:
    all are torques, which accelerate, and what follows the speed rubs."""
    return any(
        (effect.form in OF_DEMAND or (effect.looks_at_states and effect.form.base in TWISTS))
        and rubs(fit, number, SEEN)
        for number, effect in enumerate(fit.values.effects)
    )


def stands_for_friction(
    fit: JointFit, gained: float, by_friction: float, own: JointFit | None = None
) -> bool:
    """Whether it is friction under another name, which gains little more nats than friction's `own` law does:
    through free ports they are one curve, and what it looks at tells which; what friction itself looks at
    there, a motion that goes with the speed more than with the acceleration, may be that of a part which the
    reading follows from afar."""
    if gained - by_friction >= max(LAW_LEAD, FORM_SHARE * gained):
        return False
    if is_hidden_friction(fit):
        return True
    return own is not None and looks_alike(fit, own) and rubs(own, len(own.values.effects) - 1, FROM_AFAR)


def rubs(fit: JointFit, number: int, least: float) -> bool:
    """Whether this share at least of what effect `number` looks at follows the speed, and little of that the
    acceleration."""
    by_speed, by_acceleration = shares_of_motion(fit, number)
    return by_speed > least and by_acceleration < LITTLE * by_speed


def looks_alike(one: JointFit, other: JointFit) -> bool:
    """Whether the last effects of two explanations of the same records are laws that look at one motion."""
    signals = []
    for fit in (one, other):
        if not fit.values.effects or fit.values.effects[-1].ports is None:
            return False
        signals.append(Motion.of(fit, len(fit.values.effects) - 1).signal)
    return len(signals[0]) == len(signals[1]) and share_following(*signals) > ALIKE


def shares_of_motion(fit: JointFit, number: int) -> tuple[float, float]:
    """Shares of the variance of what effect `number` looks at that follow the speed of the axis and its
    acceleration."""
    row = fit.values.law_row(number)
    signals, speeds, accelerations = [], [], []
    for record in range(len(fit.response.records)):
        run = fit.response.along(fit.values, record)
        signals.append(run.signals[row])
        speeds.append(np.gradient(run.w))
        accelerations.append(np.gradient(speeds[-1]))
    signal = np.concatenate(signals)
    return share_following(signal, np.concatenate(speeds)), share_following(
        signal, np.concatenate(accelerations)
    )


def share_following(signal: FloatArray, motion: FloatArray) -> float:
    """Share of the variance of a signal (samples,) that is in proportion to a motion (samples,)."""
    if not (np.std(signal) > 0 and np.std(motion) > 0):
        return 0.0
    return float(np.corrcoef(signal, motion)[0, 1] ** 2)
