"""What of the error repeats with the direction of motion and with the angle, and what is left without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.hysteresis import THRESHOLD, Hysteresis, directions, hysteresis
from bayes_hw.first_look.ripple import Ripple, ripples
from bayes_hw.first_look.statics import Statics, statics


@dataclass(frozen=True, eq=False)
class RepeatedError:
    """Hysteresis, None where reversals are few, and ripples, none where none is clear.

    `part` is what both make of every output, (samples,) a record; `statics` and `left` are limits, dead zone
    and errors of the outputs without it.
    """

    hysteresis: Hysteresis | None
    ripples: tuple[Ripple, ...]
    part: tuple[FloatArray, ...]
    statics: Statics
    left: tuple[FloatArray, ...]

    @property
    def is_seen(self) -> bool:
        return bool(self.ripples) or self.shown_hysteresis is not None

    @property
    def shown_hysteresis(self) -> Hysteresis | None:
        """The hysteresis, where it is clear."""
        return self.hysteresis if self.hysteresis is not None and self.hysteresis.is_clear else None


def errors_of(outputs: Sequence[FloatArray], found: Statics) -> tuple[FloatArray, ...]:
    """Outputs less what the linear response to the command within its limits explains, up to a constant, a
    slope and a factor."""
    return tuple(_error(y, found, k) for k, y in enumerate(outputs))


def _error(y: FloatArray, found: Statics, record: int) -> FloatArray:
    if not found.undisturbed:
        return y - y.mean()
    predicted = found.predicted(record)
    table = np.column_stack([np.ones(len(y)), np.linspace(-1, 1, len(y)), predicted])
    return np.asarray(y - table @ np.linalg.lstsq(table, y, rcond=1e-10)[0])


def repeated_error(
    outputs: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    angles: Sequence[FloatArray],
    found: Statics,
    sample_rate_hz: float,
    noise_sigma: float,
) -> RepeatedError:
    """`outputs` count from the origin, `angles` are those of the axis itself; `noise_sigma` is the fast
    noise of one sample.

    Where something repeats, the response is fitted again without it, since it took part of it for lag, and
    the hysteresis that this leaves is added.
    """
    errors = errors_of(outputs, found)
    if not found.undisturbed:
        return RepeatedError(None, (), tuple(np.zeros(len(y)) for y in outputs), found, errors)
    seen, part = ripples(angles, errors, sample_rate_hz)
    behind = _hysteresis(found, errors, part, sample_rate_hz, noise_sigma)
    clear = behind is not None and behind.is_clear
    if not (seen or clear):
        return RepeatedError(behind, (), part, found, errors)
    if behind is not None and clear:
        part = _with_hysteresis(part, found, behind.half_width, noise_sigma)
    again, left = _refitted(outputs, commands, part, sample_rate_hz)
    more = _hysteresis(again, left, [np.zeros(len(e)) for e in left], sample_rate_hz, noise_sigma)
    if behind is not None and clear and more is not None:
        part = _with_hysteresis(part, again, more.half_width, noise_sigma)
        behind = replace(more, half_width=behind.half_width + more.half_width)
        left = errors_of([y - repeated for y, repeated in zip(outputs, part, strict=True)], again)
    elif not clear:
        behind = more
    return RepeatedError(behind, seen, part, again, left)


def _hysteresis(
    found: Statics,
    errors: Sequence[FloatArray],
    part: Sequence[FloatArray],
    sample_rate_hz: float,
    noise_sigma: float,
) -> Hysteresis | None:
    motions = [found.predicted(k) for k in range(len(errors))]
    left = [error - repeated for error, repeated in zip(errors, part, strict=True)]
    return hysteresis(motions, left, sample_rate_hz, noise_sigma)


def _with_hysteresis(
    part: Sequence[FloatArray], found: Statics, half_width: float, noise_sigma: float
) -> tuple[FloatArray, ...]:
    return tuple(
        repeated + half_width * directions(found.predicted(k), THRESHOLD * noise_sigma)
        for k, repeated in enumerate(part)
    )


def _refitted(
    outputs: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    part: Sequence[FloatArray],
    sample_rate_hz: float,
) -> tuple[Statics, tuple[FloatArray, ...]]:
    cleaned = [y - repeated for y, repeated in zip(outputs, part, strict=True)]
    again = statics(cleaned, commands, sample_rate_hz)
    return again, errors_of(cleaned, again)
