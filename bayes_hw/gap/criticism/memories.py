"""Shapes of an axis that remembers: what follows a limit that was left, or a reversal.

A function of the command or the motion now cannot show them: integrators that wind up behind a limiter,
hysteresis, torques that build up with the way since the axis turned. They are functions of the time since the
event, with the sign of the limit or of the motion, and of the command's own changes soon after a limit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.criticism.free_functions import Motion, lagged
from bayes_hw.gap.simulate.columns import hats_over
from bayes_hw.gap.simulate.injection_point import InjectionPoint

AGES_S = (0.0, 0.15, 0.4, 1.0, 2.5)
"""Knots of the hats over the time since an event."""

SOON_S = (0.3, 1.5)
"""After a limit was left, within which changes of the command count."""

LAGS = (1, 3)
"""Samples over which these changes are taken."""

AT_REST = 0.02
"""Of the root mean square speed: below it the axis has not turned yet."""


def shapes_of_memories(
    found: Sequence[Motion], rate: float
) -> dict[str, tuple[InjectionPoint, list[FloatArray]]]:
    """For every kind of event the door and the shapes (samples, n), a record each, at `rate` samples a s."""
    return {
        "after a limit": ("command", [_after_limits(m, rate) for m in found]),
        "after a reversal": ("motor_torque", shapes_after_reversals(found, rate)),
    }


def shapes_after_reversals(found: Sequence[Motion], rate: float) -> list[FloatArray]:
    """Hats over the time since the motion turned, with its sign: shapes (samples, n) a record."""
    return [_after_reversals(m, rate) for m in found]


def _after_limits(motion: Motion, rate: float) -> FloatArray:
    beyond = np.sign(motion.command - motion.limited)
    left = np.concatenate([[False], (beyond[:-1] != 0) & (beyond[1:] == 0)])
    side, age = _since(left, np.concatenate([[0.0], beyond[:-1]]), rate)
    side = np.where(beyond == 0, side, 0.0)
    soon = np.stack([(side != 0) & (age < seconds) for seconds in SOON_S], axis=1)
    changes = [change[:, None] * soon for change in lagged(motion.limited, LAGS).T]
    return np.concatenate([_hats_of_age(age) * side[:, None], *changes], axis=1)


def _after_reversals(motion: Motion, rate: float) -> FloatArray:
    least = AT_REST * float(np.sqrt(np.mean(motion.speed**2)))
    moving = np.where(np.abs(motion.speed) > least, np.sign(motion.speed), 0.0)
    latest = _held(moving)
    turned = np.concatenate([[False], latest[1:] != latest[:-1]])
    direction, age = _since(turned, latest, rate)
    return _hats_of_age(age) * direction[:, None]


def _held(signs: FloatArray) -> FloatArray:
    """The last sign that was not zero (samples,), zero before the first."""
    at = np.maximum.accumulate(np.where(signs != 0, np.arange(len(signs)), 0))
    return np.asarray(signs[at])


def _since(events: BoolArray, signs: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """The sign at the latest of `events` (samples,), zero before the first, and the seconds since."""
    places = np.arange(len(events))
    latest = np.maximum.accumulate(np.where(events, places, -1))
    return np.where(latest >= 0, signs[latest], 0.0), (places - latest) / rate


def _hats_of_age(age: FloatArray) -> FloatArray:
    """Piecewise linear shapes (samples, knots) over the time since an event, the last zero at its knot."""
    return np.ascontiguousarray(hats_over(age, np.array(AGES_S))[:, :-1])
