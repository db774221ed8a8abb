"""What a transfer function printed with few digits can still mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray
from bayes_hw.errors import InputError
from printed.nanshan import LIGHT_DAMPING

BATCH = 50_000
"""Draws whose companion matrices are held at once."""


@dataclass(frozen=True, eq=False)
class RoundingBox:
    """Every transfer function whose coefficients round to the printed ones.

    Coefficients are in powers of 1/z, constant term first: `numerator` of shape (m,) with the delay as
    leading zeros, `denominator` of shape (n + 1,) and monic. The half widths, of the same shapes, are zero
    where a coefficient is exact.
    """

    numerator: FloatArray
    denominator: FloatArray
    numerator_half_width: FloatArray
    denominator_half_width: FloatArray

    @classmethod
    def from_text(
        cls,
        numerator: Sequence[str],
        denominator: Sequence[str],
        significant_digits: int | None,
    ) -> RoundingBox:
        """Read printed coefficients; "0" and "1" are exact.

        With `significant_digits` every number counts that many digits, trailing zeros that the printer
        dropped included; with None its last printed digit is the last one.
        """
        return cls(
            np.array([float(text) for text in numerator]),
            np.array([float(text) for text in denominator]),
            np.array([_half_width(text, significant_digits) for text in numerator]),
            np.array([_half_width(text, significant_digits) for text in denominator]),
        )

    def displacement(self, numerator: FloatArray, denominator: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance of coefficients from the printed ones in half widths: inside the box it is at most one.

        An exact coefficient is at distance zero, or infinity where it differs.
        """
        return (
            _in_half_widths(numerator - self.numerator, self.numerator_half_width),
            _in_half_widths(denominator - self.denominator, self.denominator_half_width),
        )

    def sample(self, rng: np.random.Generator, draws: int) -> tuple[FloatArray, FloatArray]:
        """Uniform draws from the whole box: numerators (draws, m) and denominators (draws, n + 1)."""
        return (
            _uniform(rng, draws, self.numerator, self.numerator_half_width),
            _uniform(rng, draws, self.denominator, self.denominator_half_width),
        )

    def sample_integrators(
        self, rng: np.random.Generator, draws: int, solved_for: int | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Uniform draws from the section of the box where A(1) = 0, by rejection.

        All coefficients of A but one are drawn; that one, the widest unless `solved_for` names its index,
        follows from A(1) = 0, and the draw is kept when it lies in its interval. The section is a piece of a
        hyperplane and the map from the drawn coefficients to it is linear, so the result is uniform on it
        whichever coefficient is solved for. Returns numerators (draws, m) and denominators (draws, n + 1).
        Raises InputError when the box does not reach A(1) = 0.
        """
        if abs(self.denominator.sum()) >= self.denominator_half_width.sum():
            raise InputError("rounding box: no member has a pole at z = 1; nothing to draw")
        index = int(np.argmax(self.denominator_half_width)) if solved_for is None else solved_for
        kept: list[FloatArray] = []
        count = 0
        while count < draws:
            batch = _uniform(rng, BATCH, self.denominator, self.denominator_half_width)
            batch[:, index] = -np.delete(batch, index, axis=1).sum(axis=1)
            offset = np.abs(batch[:, index] - self.denominator[index])
            kept.append(batch[offset <= self.denominator_half_width[index]])
            count += len(kept[-1])
        numerators = _uniform(rng, draws, self.numerator, self.numerator_half_width)
        return numerators, np.concatenate(kept)[:draws]


@dataclass(frozen=True)
class StableShare:
    """How many of `draws` uniform draws were stable; `share` and its binomial standard error."""

    stable: int
    draws: int

    @property
    def share(self) -> float:
        return self.stable / self.draws

    @property
    def standard_error(self) -> float:
        return math.sqrt(self.share * (1 - self.share) / self.draws)


@dataclass(frozen=True, eq=False)
class RoundingUncertainty:
    """What rounding leaves uncertain, over draws of the box.

    `stable_in_box` counts members with all poles strictly inside the circle; `stable_integrators` counts,
    among members with an exact pole at z = 1, those whose other poles are. The arrays hold those members:
    `numerators` (members, m), `denominators` (members, n + 1), `poles` (members, n - 1) without the
    integrator, `zeros` (members, ...), `frequency_hz` and `damping_ratio` (members, resonances) in order of
    frequency, `velocity_gain` (members,) at zero frequency, in output units per second and unit of v, and
    `gain_curve` (members, points), |G| 2 pi f in the same unit, at `gain_frequency_hz` (points,).
    """

    stable_in_box: StableShare
    stable_integrators: StableShare
    numerators: FloatArray
    denominators: FloatArray
    poles: ComplexArray
    zeros: ComplexArray
    frequency_hz: FloatArray
    damping_ratio: FloatArray
    velocity_gain: FloatArray
    gain_frequency_hz: FloatArray
    gain_curve: FloatArray


def rounding_uncertainty(
    box: RoundingBox,
    rng: np.random.Generator,
    draws: int,
    sample_rate_hz: float,
    gain_frequency_hz: FloatArray,
) -> RoundingUncertainty:
    """Draw `draws` members of the box for each of the two shares and describe the stable integrators.

    Raises InputError when the stable integrators do not all have the same number of resonances, or when
    there are none among the draws.
    """
    _, whole = box.sample(rng, draws)
    stable_in_box = StableShare(int(np.count_nonzero(_inside(roots_of_rows(whole)))), draws)

    numerators, denominators = box.sample_integrators(rng, draws)
    poles = roots_of_rows(without_integrator(denominators))
    stable = _inside(poles)
    if not stable.any():
        raise InputError("rounding box: no stable integrator among the draws; take more draws")
    numerators, denominators, poles = numerators[stable], denominators[stable], poles[stable]

    frequency, damping = resonances(poles, sample_rate_hz)
    at_one = without_integrator(denominators).sum(axis=1)
    return RoundingUncertainty(
        stable_in_box=stable_in_box,
        stable_integrators=StableShare(int(np.count_nonzero(stable)), draws),
        numerators=numerators,
        denominators=denominators,
        poles=poles,
        zeros=roots_of_rows(numerators[:, int(np.flatnonzero(box.numerator)[0]) :]),
        frequency_hz=frequency,
        damping_ratio=damping,
        velocity_gain=sample_rate_hz * numerators.sum(axis=1) / at_one,
        gain_frequency_hz=gain_frequency_hz,
        gain_curve=velocity_gain_curve(numerators, denominators, gain_frequency_hz, sample_rate_hz),
    )


def roots_of_rows(coefficients: FloatArray) -> ComplexArray:
    """Roots (rows, n) of many polynomials c0 z^n + ... + cn, given as rows (rows, n + 1), c0 not zero."""
    degree = coefficients.shape[1] - 1
    roots = np.empty((len(coefficients), degree), dtype=np.complex128)
    for start in range(0, len(coefficients), BATCH):
        rows = coefficients[start : start + BATCH]
        companion = np.zeros((len(rows), degree, degree))
        companion[:, 0] = -rows[:, 1:] / rows[:, :1]
        companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1
        roots[start : start + BATCH] = np.linalg.eigvals(companion)
    return roots


def without_integrator(denominators: FloatArray) -> FloatArray:
    """A(z) / (1 - 1/z) for rows of A with A(1) = 0: one column fewer."""
    return np.cumsum(denominators, axis=1)[:, :-1]


def resonances(poles: ComplexArray, sample_rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies in Hz and damping ratios, each (rows, resonances), of the lightly damped pole pairs.

    A pair counts when its damping ratio is below LIGHT_DAMPING. Raises InputError when rows differ in
    their number of such pairs.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.log(poles) * sample_rate_hz
        damping = -s.real / np.abs(s)
    chosen = (poles.imag > 0) & (damping < LIGHT_DAMPING)
    counts = np.count_nonzero(chosen, axis=1)
    if np.ptp(counts):
        raise InputError(
            f"poles: rows have {counts.min()} to {counts.max()} lightly damped pairs; "
            "they cannot be compared one by one"
        )
    shape = (len(poles), int(counts[0]))
    frequency = (np.abs(s[chosen]) / (2 * np.pi)).reshape(shape)
    order = np.argsort(frequency, axis=1)
    return (
        np.take_along_axis(frequency, order, axis=1),
        np.take_along_axis(damping[chosen].reshape(shape), order, axis=1),
    )


def velocity_gain_curve(
    numerators: FloatArray,
    denominators: FloatArray,
    frequency_hz: FloatArray,
    sample_rate_hz: float,
) -> FloatArray:
    """|G| 2 pi f, output units per second and unit of v: shape (rows, frequencies)."""
    delays = np.exp(-2j * np.pi * frequency_hz / sample_rate_hz)
    numerator = numerators @ delays[None, :] ** np.arange(numerators.shape[1])[:, None]
    denominator = denominators @ delays[None, :] ** np.arange(denominators.shape[1])[:, None]
    return np.asarray(np.abs(numerator / denominator) * 2 * np.pi * frequency_hz, dtype=np.float64)


def _half_width(text: str, significant_digits: int | None) -> float:
    value = Decimal(text)
    if text in ("0", "1"):
        return 0.0
    exponent = value.as_tuple().exponent
    if not isinstance(exponent, int):
        raise InputError(f"rounding box: {text!r} is not a finite number")
    last_digit = exponent if significant_digits is None else value.adjusted() - significant_digits + 1
    return float(Decimal(5).scaleb(last_digit - 1))


def _in_half_widths(difference: FloatArray, half_width: FloatArray) -> FloatArray:
    exact = half_width == 0
    scaled = difference / np.where(exact, 1, half_width)
    return np.where(exact & (difference != 0), np.inf, scaled)


def _uniform(rng: np.random.Generator, draws: int, centre: FloatArray, half_width: FloatArray) -> FloatArray:
    return centre + half_width * rng.uniform(-1, 1, (draws, len(centre)))


def _inside(poles: ComplexArray) -> BoolArray:
    return np.all(np.abs(poles) < 1, axis=1)
