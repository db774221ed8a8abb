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
from bayes_hw.model.linear import Mode, mode_pole

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
        """Real poles, `light` poles of the modes, other pairs and zeros, a row a point, moved by these
        coordinates."""
        points, upper = len(light), self.zeros[self.zeros.imag > 0]
        others = np.broadcast_to(np.concatenate([self.pairs, upper]), (points, len(self.pairs) + len(upper)))
        roots = np.concatenate([others, light], axis=1)
        at = 2 * roots.shape[1]
        moved = _scaled(roots, loose[:, :at:2], loose[:, 1:at:2])
        real = []
        for given in (self.real, _real(self.zeros)):
            values, chosen = np.tile(given, (points, 1)), _loosened(given)
            n = int(chosen.sum())
            values[:, chosen] = np.exp(np.log(given[chosen]) * np.exp(loose[:, at : at + n]))
            at += n
            real.append(values)
        pairs, upper, light = np.split(moved, [len(self.pairs), len(self.pairs) + len(upper)], axis=1)
        zeros = np.concatenate([upper, upper.conj(), real[1].astype(np.complex128)], axis=1)
        return real[0], light, pairs, zeros

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

    def natural(self, thetas: FloatArray, part: bool, further: bool) -> FloatArray:
        """Natural parameters (points, natural) at coordinates (points, size): base, part of a sample of
        delay, a further mode and what it loosens. Limits, half width, the integrator's residue, pole and
        residue of every real pole, a1, a2, b1, b2 of every section."""
        points = len(thetas)

        def everywhere(roots: FloatArray | ComplexArray) -> ComplexArray:
            return np.broadcast_to(roots, (points, len(roots))).astype(np.complex128)

        gain = self.gain * np.exp(thetas[:, 3:STATIC])
        moved = np.exp(thetas[:, STATIC : self.size].reshape(points, -1, 2))
        modes = np.array([(m.frequency_hz, m.damping_ratio) for m in self.modes]).reshape(-1, 2)
        damping = np.minimum(modes[:, 1] * moved[:, :, 1], 0.99)
        light = mode_pole(modes[:, 0] * moved[:, :, 0], damping, self.rate_hz)
        zeros, pairs, fixed = everywhere(self.zeros), everywhere(self.pairs), everywhere(self.real).real
        if further:
            begin = self.size + int(part)
            plain = _at_rest(fixed, np.concatenate([pairs, light], axis=1), zeros)
            fixed, light, pairs, zeros = self._with_loose(light, thetas[:, begin + FURTHER :])
            gain *= plain / _at_rest(fixed, np.concatenate([pairs, light], axis=1), zeros)
            own = np.exp(thetas[:, begin : begin + FURTHER].reshape(points, 2, 2))
            added = mode_pole(own[:, :, 0], own[:, :, 1], self.rate_hz)
            pole, zero = added[:, :1], added[:, 1:]
            light = np.concatenate([light, pole], axis=1)
            zeros = np.concatenate([zeros, zero, np.conjugate(zero)], axis=1)
            gain *= np.abs(1 - pole) ** 2 / np.abs(1 - zero) ** 2
        upper = np.concatenate([pairs, light], axis=1)
        real = np.concatenate([np.ones((points, int(self.integrator))), fixed], axis=1)
        n_real, count = real.shape[1], real.shape[1] + upper.shape[1]
        poles = np.concatenate([real.astype(np.complex128), upper, upper.conj()], axis=1)
        difference = poles[:, :count, None] - poles[:, None, :]
        difference[:, np.arange(count), np.arange(count)] = 1.0
        above = np.prod(poles[:, :count, None] - zeros[:, None, :], axis=2)
        residues = gain * above / np.prod(difference, axis=2)
        further_rows = [(NEARLY_ONE, np.zeros(points))] if self.integrator else []
        if part:
            residues, direct = _delayed(poles[:, :count], residues, thetas[:, self.size], n_real)
            further_rows.append((0.0, direct))
        columns = list((np.exp(thetas[:, :3]) * [self.lower, self.upper, self.half_width]).T)
        if self.integrator:
            columns.append(residues[:, 0].real)
        for i in range(int(self.integrator), n_real):
            columns += [real[:, i], residues[:, i].real]
        for at, residue in further_rows:
            columns += [np.full(points, at), residue]
        for pole, residue in zip(upper.T, residues[:, n_real:].T, strict=True):
            twice = 2 * residue
            columns += [2 * pole.real, np.abs(pole) ** 2, twice.real, -(twice * pole.conj()).real]
        return np.stack(columns, axis=1)

    def cascade(self, theta: FloatArray, part: bool, further: bool) -> GivenCascade:
        """The cascade at coordinates (size,)."""
        (row,) = self.natural(theta[None], part, further)
        structure = self.structure(part, further)
        at = STATIC - 1 + int(self.integrator)
        end = at + 2 * structure.real_poles
        order = int(self.integrator) + structure.real_poles + 2 * structure.sections
        return GivenCascade(
            float(row[0]), float(row[1]), float(row[2]), 0.0,
            float(row[3]) if self.integrator else 0.0,
            row[at:end].reshape(-1, 2).T, row[end:].reshape(-1, 4).T, np.zeros((0, order)), theta,
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


def _at_rest(real: FloatArray, pairs: ComplexArray, zeros: ComplexArray) -> FloatArray:
    """Responses (points, 1) at rest of unit gain, but for their sign."""
    over = np.prod(np.abs(1 - pairs) ** -2.0, axis=1) / np.prod(np.abs(1 - real), axis=1)
    return np.asarray(np.prod(np.abs(1 - zeros), axis=1) * over)[:, None]


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
    poles: ComplexArray, residues: ComplexArray, parts: FloatArray, n_real: int
) -> tuple[ComplexArray, FloatArray]:
    """Residues (points, poles) behind parts (points,) of a sample of delay, and what the first sample of all
    together gains."""
    part = parts[:, None]
    plain = np.abs(poles) < HARDLY
    plain[:, :n_real] |= poles[:, :n_real].real < HARDLY
    safe = np.where(plain, 0.5, poles)
    turned = residues * safe ** (-part)
    at_one = np.abs(safe - 1) < 1e-9
    denominator = np.where(at_one, 1.0, safe - 1)
    first = np.where(at_one, 1 - part, (safe ** (1 - part) - 1) / denominator) * residues
    lost = np.where(plain, 0.0, first - turned)
    direct = lost[:, :n_real].real.sum(axis=1) + 2 * lost[:, n_real:].real.sum(axis=1)
    return np.where(plain, residues, turned), direct
