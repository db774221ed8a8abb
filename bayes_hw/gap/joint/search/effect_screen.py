"""What every form of every label promises at a fit, by score tests, all present coordinates projected off.

Twice: under the noise that was fitted and under a first-order one, since a fitted autoregression of high
order hides slow effects that G and the noise have taken up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray, highest_peaks
from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale
from bayes_hw.gap.joint.forms.joint_forms import scanned_cycles
from bayes_hw.gap.joint.residuals.noise_screen import NoiseScreen, noise_screens
from bayes_hw.gap.joint.response.effect_paths import motor_angle

PERIODS_KEPT, MOTOR_PERIODS_KEPT = 6, 3
"""Of a scan under each noise, of the load's position and of the motor's."""

WAVES_AT_ONCE = 8
"""Whose columns are projected together."""

TURNING_SHARE = 0.05
"""Of the root mean square speed: over which the phase of a torque's response turns round at a reversal."""


@dataclass(frozen=True, eq=False)
class Start:
    """A form at a start, and the nats that it promises under both noises."""

    form: Form
    values: tuple[float, ...]
    gains: tuple[float, ...]


def screened(fit: JointFit, forms: Sequence[Form]) -> list[Start]:
    """Every start of every form with its promises."""
    noises, scale = noise_screens(fit), fit.response.scale
    if any(begins_with_periods(form, scale) for form in forms):
        of_load, of_motor = promising_periods(fit, noises)
        scale = replace(scale, periods=of_load, motor_periods=of_motor)

    def promising(one: tuple[Form, Sequence[float]]) -> Start:
        form, values = one
        tangents = fit.effect_tangents(form, values)
        return Start(form, tuple(values), tuple(noise.gain(tangents) for noise in noises))

    return each(promising, [(form, values) for form in forms for values in form.starts(scale)])


def begins_with_periods(form: Form, scale: JointScale) -> bool:
    """Whether a form's starts depend on the periods that a scan finds, long or short."""
    some = tuple(scale.travel / turns for turns in (1.5, 7.0, 60.0))
    found = replace(scale, periods=some, motor_periods=some)
    return list(form.starts(found)) != list(form.starts(scale))


def promising_periods(
    fit: JointFit, noises: Sequence[NoiseScreen]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Periods in position, output units, at which the residual follows a wave, of either phase in either
    direction of motion: a torque's response lags, so that its phase turns round with the speed. Those in the
    position of the load, and those in the motor's, which a resonance sets apart."""
    values, travel = fit.values, fit.response.scale.travel
    cycles = scanned_cycles()
    cycles = cycles[travel / cycles >= fit.response.scale.shortest]
    if not len(cycles):
        return (), ()
    waves = []
    for number in range(len(fit.response.records)):
        run = fit.response.along(values, number)
        speed = np.gradient(run.w)
        usual = float(np.sqrt(np.mean(speed**2))) or 1.0
        over = 1.0 if fit.response.weights is None else fit.response.weights[number]
        positions = (run.w, motor_angle(fit.structure, values, run.v))
        waves.append((positions, np.tanh(speed / (TURNING_SHARE * usual)), run.slope / over))

    def promised(counts: FloatArray, body: int) -> FloatArray:
        """Nats (noises, counts)."""
        tangents = []
        for positions, direction, slope in waves:
            angle = 2 * np.pi / travel * counts[:, None] * positions[body]
            plain = np.stack([np.sin(angle), np.cos(angle)], axis=1)
            tangents.append(np.concatenate([plain, plain * direction], axis=1) * slope)
        return np.stack([noise.gains(tangents) for noise in noises])

    def best_of(body: int, kept: int) -> tuple[float, ...]:
        best: set[int] = set()
        parts = [cycles[i : i + WAVES_AT_ONCE] for i in range(0, len(cycles), WAVES_AT_ONCE)]
        for row in np.concatenate(each(lambda part: promised(part, body), parts), axis=1):
            best |= {int(i) for i in highest_peaks(row)[:kept]}
        return tuple(float(travel / cycles[i]) for i in sorted(best))

    return best_of(0, PERIODS_KEPT), best_of(1, MOTOR_PERIODS_KEPT)


def best_starts(starts: Sequence[Start], count: int) -> list[Start]:
    """The most promising of one label: by every noise in turn, `count` in all, forms of one kind apart."""
    chosen: list[Start] = []
    n_noises = max((len(s.gains) for s in starts), default=0)
    ranked = [sorted(starts, key=lambda s, i=i: -s.gains[i]) for i in range(n_noises)]  # type: ignore[misc]
    position = 0
    while len(chosen) < count and any(ranked):
        for order in ranked:
            while order:
                one = order.pop(0)
                if all(_apart(one, other) for other in chosen):
                    chosen.append(one)
                    break
        position += 1
    return chosen[:count]


def _apart(one: Start, other: Start) -> bool:
    if one.form is not other.form:
        return True
    mine, others = np.array(one.values), np.array(other.values)
    ratio = np.abs(np.log((np.abs(mine) + 1e-12) / (np.abs(others) + 1e-12)))
    return bool(ratio.max(initial=0.0) > 0.3)
