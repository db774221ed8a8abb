"""A given model.json inside the joint search: its G as parallel sections at any base parameters.

Poles other than the dominant modes, zeros and delay stay as given. A further mode multiplies G by a pole pair
over a zero pair of unit gain at rest; a delay of a part of a sample is exact for inputs held over a sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.simulate.nominal_prior import (
    DAMPING_LOG_SD,
    DEAD_ZONE_LOG_SD,
    FREQUENCY_LOG_SD,
    GAIN_LOG_SD,
    LIMIT_LOG_SD,
)
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import Mode

STATIC = 4
"""Base coordinates before those of the modes: logarithms of limits, half width, gain over nominal."""

FURTHER = 4
"""Coordinates of a further mode: logarithms of frequency (Hz) and damping of its poles, then of its zeros."""

LOOSE_FREQUENCY_SD, LOOSE_DAMPING_SD = 0.08, 0.5
"""Standard deviations of logarithms by which a further mode moves the other roots of G, poles and zeros."""

WIDEST = 4.0
"""Standard deviations of the nominal prior within which base parameters are looked for."""

APART = 1e-5
HARDLY = 0.02
"""Poles with a modulus or a real part below: a part of a sample of delay leaves them as they are."""

NEAR_ONE = 1e-4
NEARLY_ONE = 1 - 1e-7
"""A pole that the command does not reach: where a loop has no integral, torques shift the axis for good."""

SMALLEST_HALF_WIDTH = 1e-9
LIGHTEST, HEAVIEST = np.log(0.001), np.log(0.6)


@dataclass(frozen=True, eq=False)
class GivenCascade(CascadeValues):
    """A cascade that knows the coordinates (base parameters and what was added to G) it comes from."""

    theta: FloatArray


@dataclass(frozen=True, eq=False)
class GivenModel:
    """Nominal values of a model; its roots: `real` and `pairs` (upper) other than the modes, zeros."""

    lower: float
    upper: float
    half_width: float
    gain: float
    modes: tuple[Mode, ...]
    real: FloatArray
    pairs: ComplexArray
    zeros: ComplexArray
    delay_samples: int
    rate_hz: float
    integrator: bool

    @classmethod
    def of(cls, model: HammersteinWiener, smallest_half_width: float) -> GivenModel:
        """Raises InputError where G has a direct path that no delay hides."""
        linear = model.linear
        poles, delay = linear.poles.astype(np.complex128), linear.delay_samples
        if len(linear.zeros) == len(poles):
            if delay == 0:
                raise InputError(f"{model.name}: G answers within the sample; ports need a delay")
            poles, delay = np.append(poles, 0.0), delay - 1
        taken = model.mode_indices()
        light = [poles[i] for i in taken]
        rest = [
            p
            for i, p in enumerate(poles)
            if i not in taken and not any(abs(p - q.conjugate()) < 1e-12 for q in light)
        ]
        real = _separated(np.sort(np.array([p.real for p in rest if p.imag == 0])))
        integrators = np.abs(real - 1) < 1e-9
        integrator = bool(integrators.sum() == 1)
        return cls(
            model.saturation.lower, model.saturation.upper,
            max(model.dead_zone.half_width, smallest_half_width), linear.gain,
            tuple(Mode.from_pole(p, model.sample_rate_hz) for p in light),
            real[~integrators] if integrator else real,
            np.array([p for p in rest if p.imag > 0], dtype=np.complex128),
            linear.zeros.astype(np.complex128), delay, model.sample_rate_hz, integrator,
        )  # fmt: skip

    @property
    def size(self) -> int:
        """Number of base coordinates."""
        return STATIC + 2 * len(self.modes)

    def prior_sd(self) -> FloatArray:
        """Standard deviations (size,) of the base coordinates about zero."""
        modes = [FREQUENCY_LOG_SD, DAMPING_LOG_SD] * len(self.modes)
        return np.array([LIMIT_LOG_SD, LIMIT_LOG_SD, DEAD_ZONE_LOG_SD, GAIN_LOG_SD, *modes])

    @cached_property
    def loose_sd(self) -> FloatArray:
        """Standard deviations of the coordinates that loosen the other roots beside a further mode."""
        pairs = len(self.pairs) + int(np.sum(self.zeros.imag > 0)) + len(self.modes)
        real = int(np.sum(_loosened(self.real))) + int(np.sum(_loosened(_real(self.zeros))))
        return np.array([LOOSE_FREQUENCY_SD, LOOSE_DAMPING_SD] * pairs + [LOOSE_FREQUENCY_SD] * real)

    def all_sd(self, part: bool, further: bool) -> FloatArray:
        """Of every coordinate; infinite where nothing is known."""
        loose = self.loose_sd if further else np.empty(0)
        open_ended = np.full(int(part) + FURTHER * int(further), np.inf)
        return np.concatenate([self.prior_sd(), open_ended, loose])

    def _with_loose(
        self, light: ComplexArray, loose: FloatArray
    ) -> tuple[FloatArray, ComplexArray, ComplexArray, ComplexArray]:
        """Real poles, `light` poles of the modes, other pairs and zeros moved by these coordinates."""
        upper = self.zeros[self.zeros.imag > 0]
        roots = np.concatenate([self.pairs, upper, light])
        count = 2 * len(roots)
        moved = _scaled(roots, loose[:count:2], loose[1:count:2])
        real, zeros = self.real.copy(), _real(self.zeros)
        at = count
        for values in (real, zeros):
            chosen = _loosened(values)
            n = int(chosen.sum())
            values[chosen] = np.exp(np.log(values[chosen]) * np.exp(loose[at : at + n]))
            at += n
        pairs, upper, light = np.split(moved, [len(self.pairs), len(self.pairs) + len(upper)])
        return real, light, pairs, np.concatenate([upper, upper.conj(), zeros.astype(np.complex128)])

    def structure(self, part: bool, further: bool, extra_delay: int = 0) -> Structure:
        """That of `cascade`."""
        return Structure(
            self.delay_samples + extra_delay,
            self.integrator,
            len(self.real) + int(self.integrator) + int(part),
            len(self.pairs) + len(self.modes) + int(further),
            lower=True,
            upper=True,
            dead_zone=True,
        )

    def bounds(self, part: bool, further: bool) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest coordinates."""
        wide = WIDEST * self.prior_sd()
        low, high = -wide, wide.copy()
        low[2] = np.log(SMALLEST_HALF_WIDTH / self.half_width)
        for i, mode in enumerate(self.modes):
            at = STATIC + 2 * i + 1
            high[at] = min(high[at], np.log(0.7 / mode.damping_ratio))
        if part:
            low, high = np.append(low, 0.0), np.append(high, 1.0)
        if further:
            f = [np.log(0.02), np.log(0.47 * self.rate_hz)]
            low = np.append(low, [f[0], LIGHTEST, f[0], LIGHTEST])
            high = np.append(high, [f[1], HEAVIEST, f[1], HEAVIEST])
            low, high = np.append(low, -WIDEST * self.loose_sd), np.append(high, WIDEST * self.loose_sd)
        return low, high

    def cascade(self, theta: FloatArray, part: bool, further: bool) -> GivenCascade:
        """The cascade at coordinates: base, part of a sample of delay, a further mode and what it loosens."""
        gain = self.gain * float(np.exp(theta[3]))
        moved = np.exp(theta[STATIC : self.size].reshape(-1, 2))
        light = np.array(
            [
                Mode(m.frequency_hz * f, min(m.damping_ratio * d, 0.99)).pole(self.rate_hz)
                for m, (f, d) in zip(self.modes, moved, strict=True)
            ],
            dtype=np.complex128,
        )
        zeros, pairs, fixed = self.zeros, self.pairs, self.real
        if further:
            begin = self.size + int(part)
            plain = self.real, np.concatenate([self.pairs, light]), self.zeros
            fixed, light, pairs, zeros = self._with_loose(light, theta[begin + FURTHER :])
            gain *= _at_rest(*plain) / _at_rest(fixed, np.concatenate([pairs, light]), zeros)
            f, d, f_zero, d_zero = np.exp(theta[begin : begin + FURTHER])
            pole = Mode(float(f), float(d)).pole(self.rate_hz)
            zero = Mode(float(f_zero), float(d_zero)).pole(self.rate_hz)
            light = np.append(light, pole)
            zeros = np.append(zeros, [zero, np.conjugate(zero)])
            gain *= abs(1 - pole) ** 2 / abs(1 - zero) ** 2
        upper = np.concatenate([pairs, light])
        real = np.append(1.0, fixed) if self.integrator else fixed
        poles = np.concatenate([real.astype(np.complex128), upper, upper.conj()])
        count = len(real) + len(upper)
        difference = poles[:count, None] - poles[None, :]
        difference[np.arange(count), np.arange(count)] = 1.0
        above = np.prod(poles[:count, None] - zeros[None, :], axis=1)
        residues = gain * above / np.prod(difference, axis=1)
        direct = 0.0
        if part:
            residues, direct = _delayed(poles[:count], residues, float(theta[self.size]), len(real))
        real_residues, pair_residues = residues[: len(real)].real, residues[len(real) :]
        sections = np.stack([
            2 * upper.real, np.abs(upper) ** 2,
            2 * pair_residues.real, -2 * (pair_residues * upper.conj()).real,
        ])  # fmt: skip
        integral = 0.0
        if self.integrator:
            integral, real_residues = float(real_residues[0]), real_residues[1:]
        rows = np.stack([fixed, real_residues])
        if self.integrator:
            rows = np.column_stack([rows, [NEARLY_ONE, 0.0]])
        if part:
            rows = np.column_stack([rows, [0.0, direct]])
        lower, upper_limit, half_width = np.exp(theta[:3]) * [self.lower, self.upper, self.half_width]
        order = int(self.integrator) + rows.shape[1] + 2 * sections.shape[1]
        return GivenCascade(
            float(lower), float(upper_limit), float(half_width), 0.0, integral, rows, sections,
            np.zeros((0, order)), theta,
        )  # fmt: skip

    def named(self, theta: FloatArray) -> dict[str, float]:
        """Base parameters, named as in posterior.json, less the noise."""
        lower, upper, half_width, gain = np.exp(theta[:STATIC]) * [
            self.lower,
            self.upper,
            self.half_width,
            self.gain,
        ]
        found = {
            "saturation.lower": float(lower), "saturation.upper": float(upper),
            "dead_zone.half_width": float(half_width), "gain": float(gain),
        }  # fmt: skip
        moved = np.exp(theta[STATIC : self.size].reshape(-1, 2))
        pairs = sorted(
            (m.frequency_hz * f, m.damping_ratio * d) for m, (f, d) in zip(self.modes, moved, strict=True)
        )
        for number, (f, d) in enumerate(pairs, start=1):
            found[f"mode{number}.frequency_hz"], found[f"mode{number}.damping_ratio"] = float(f), float(d)
        return found


def _real(roots: ComplexArray) -> FloatArray:
    return roots[roots.imag == 0].real.copy()


def _at_rest(real: FloatArray, pairs: ComplexArray, zeros: ComplexArray) -> float:
    """Response at rest of unit gain, but for its sign."""
    over = np.prod(np.abs(1 - pairs) ** -2.0) / np.prod(np.abs(1 - real))
    return float(np.prod(np.abs(1 - zeros)) * over)


def _loosened(real: FloatArray) -> BoolArray:
    """Real roots with a logarithm that is not nearly zero."""
    return (real > HARDLY) & (np.abs(real - 1) > NEAR_ONE)


def _scaled(roots: ComplexArray, frequency: FloatArray, damping: FloatArray) -> ComplexArray:
    """Roots whose logarithms grow by exp(frequency), the real parts by exp(damping) beside."""
    s = np.log(roots)
    return np.exp((s.real * np.exp(damping) + 1j * s.imag) * np.exp(frequency))


def _separated(poles: FloatArray) -> FloatArray:
    """Real poles at least APART from one another: equal ones have no residues."""
    found = poles.copy()
    for i in range(1, len(found)):
        found[i] = max(found[i], found[i - 1] + APART)
    return found


def _delayed(
    poles: ComplexArray, residues: ComplexArray, part: float, n_real: int
) -> tuple[ComplexArray, float]:
    """Residues behind `part` of a sample of delay, and what the first sample of all together gains."""
    plain = np.abs(poles) < HARDLY
    plain[:n_real] |= poles[:n_real].real < HARDLY
    safe = np.where(plain, 0.5, poles)
    turned = residues * safe ** (-part)
    at_one = np.abs(safe - 1) < 1e-9
    denominator = np.where(at_one, 1.0, safe - 1)
    first = np.where(at_one, 1 - part, (safe ** (1 - part) - 1) / denominator) * residues
    lost = np.where(plain, 0.0, first - turned)
    direct = float(lost[:n_real].real.sum() + 2 * lost[n_real:].real.sum())
    return np.where(plain, residues, turned), direct
