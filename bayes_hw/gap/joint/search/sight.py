"""What a law looks at, told from its signal: a speed or a twist.

Through free ports friction and contact in a gap are one law over different signals. Friction follows the
speed of the axis; the twist of the drive is the torque that it passes on, which accelerates the load.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import BY_TWIST, REMEMBERING
from bayes_hw.gap.joint.response.joint_values import JointValues

MOSTLY, SEEN, LITTLE = 0.5, 0.2, 0.5
"""Shares of a signal's variance: that follow the acceleration in a twist, and the speed in a friction, at
least; the other one over that, at most."""


TWISTS = (K.BASE_TWIST, K.BASE_TWIST_RATE)


def named_by_sight(fit: JointFit) -> JointFit:
    """The fit with frictions that look at a twist under the name of what does so; nothing else changes."""
    effects = list(fit.values.effects)
    for number, effect in enumerate(effects):
        if (
            effect.form in BY_TWIST
            and effect.ports is not None
            and effect.ports.signal
            and sees_twist(fit, number)
        ):
            lasting = effect.form in REMEMBERING and remembers(fit, number)
            effects[number] = replace(effect, form=(REMEMBERING if lasting else BY_TWIST)[effect.form])
    if all(new.form is old.form for new, old in zip(effects, fit.values.effects, strict=True)):
        return fit
    return fit.moved(fit.structure, JointValues(fit.values.cascade, tuple(effects)), fit.point.whitener)


def sees_twist(fit: JointFit, number: int) -> bool:
    """Whether the law of effect `number` looks at a twist."""
    by_speed, by_acceleration = shares_of_motion(fit, number)
    return by_acceleration > MOSTLY and by_speed < LITTLE * by_acceleration


def remembers(fit: JointFit, number: int) -> bool:
    """Whether the bristles of effect `number` are left behind by less than their length in the median sample:
    what they have forgotten within one is a function of what the law looks at now, and closes no loop."""
    row = fit.values.law_row(number)
    signals = [fit.response.along(fit.values, i).signals[row] for i in range(len(fit.response.records))]
    return float(np.median(np.abs(np.concatenate(signals)))) < float(fit.values.effects[number].values[0])


def is_hidden_friction(fit: JointFit) -> bool:
    """Whether a law over a twist or its rate looks at the speed of the axis: what does so rubs."""
    for number, effect in enumerate(fit.values.effects):
        if effect.form.base in TWISTS and effect.ports is not None and effect.ports.signal:
            by_speed, by_acceleration = shares_of_motion(fit, number)
            if by_speed > SEEN and by_acceleration < LITTLE * by_speed:
                return True
    return False


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
