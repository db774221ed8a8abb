"""The delay at which a cascade's G has no zeros.

Where the rate is high beside the modes, zeros that stand beyond them stand in for samples of delay, and
records do not tell which of them there are. A drive train in series has none: its poles s_i alone give the
residues, and a delay of tau samples turns them,

    r_i = K a_i exp(s_i (d - tau)),    a_i = prod_{j != i} 1 / (x_i - x_j)

with d the delay that the residues belong to and x the poles: of samples (z), or of continuous time behind a
command that is held (s; then times (z_i - 1) / s_i). Every mode tells tau by its phase, and by its size
whether there are zeros after all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.cascade_roots import section_poles
from bayes_hw.identify.growth.delay import begun_at
from bayes_hw.identify.growth.descent import triangular_factor
from bayes_hw.identify.growth.extension import pair_of, section_of, without_real_pole, without_section
from bayes_hw.identify.growth.search import Grown
from bayes_hw.identify.growth.slow_poles import slow_time_constants


def without_zeros(item: Grown) -> Grown:
    """`item` at the delay at which its G has no zeros, its weights free; as it is where no such G explains as
    much but for what the criterion asks for the numbers that zeros would have. Slow parts, which are kept for
    what they have in common with a dead zone, say nothing of it."""
    fast = without_slow_parts(item)
    if not fast.structure.integrator or fast.structure.order < 3:
        return item
    spared = fast.structure.order - 2
    asked = 0.5 * spared * float(np.log(item.point.samples))
    found = []
    for held in (False, True):
        begun = in_series(fast, held)
        if begun is None:
            continue
        # Weights that are free lead to the poles of that delay, of which the series is asked again.
        free = begun.descended()
        of_zeros = nats_of_zeros(free, held)
        if of_zeros is not None:
            found.append((fast.log_likelihood - free.log_likelihood + of_zeros, free))
    lost, best = min(found, key=lambda one: one[0], default=(np.inf, item))
    if lost >= asked:
        return item
    return best if fast is item else begun_at(item, best.structure.delay_samples)


def without_slow_parts(item: Grown) -> Grown:
    """`item` without the real poles and sections that are slow, descended; itself where it has none."""
    slowest = 1 / slow_time_constants(item)[0]
    structure, values = item.structure, item.values
    for number in reversed(range(structure.sections)):
        a1, a2 = values.sections[:2, number]
        if np.abs(np.log(section_poles(a1, a2))).max() < slowest:
            structure, values = without_section(structure, values, number)
    for number in reversed(range(structure.real_poles)):
        if 1 - values.real[0, number] < slowest:
            structure, values = without_real_pole(structure, values, number)
    if structure == item.structure:
        return item
    return Grown.at(structure, values, item.response.records, item.point.most_noise).descended()


def nats_of_zeros(item: Grown, held: bool) -> float | None:
    """What the zeros of `item` gain over the likeliest series of poles with the same delay, but for a
    fraction of a sample, by the curvature of its likelihood; None where its residues are of no series."""
    begun = _Series.of(item.values, held)
    if begun is None:
        return None
    factor = triangular_factor(item.response, item.point)[:, :-1]
    factor = factor / np.sqrt(item.point.sum_of_squares / item.point.samples)
    at, static = item.point.coordinates, item.structure.n_static

    def error(x: FloatArray) -> FloatArray:
        """Of coordinates of a series: those of the nonlinearities, of the poles, gain and delay."""
        moved = at.copy()
        moved[:static] = x[:static]
        moved[item.response.pole_rows()] = x[static:-2]
        values = item.response.values(moved)
        own = replace(begun, gain=x[-2], delay=x[-1]).residues(values)
        with np.errstate(invalid="ignore"):
            return np.asarray(factor @ (item.response.coordinates(_with_residues(values, own)) - at))

    x = np.concatenate([at[:static], at[item.response.pole_rows()], [begun.gain, begun.delay]])
    ended = least_squares(error, x, x_scale="jac", method="trf")
    return float(ended.cost)


def in_series(item: Grown, held: bool) -> Grown | None:
    """`item` with the residues of its poles in series, at the delay that its own agree on best: of samples,
    or `held` in continuous time; None where its residues are of no series."""
    series = _Series.of(item.values, held)
    if series is None:
        return None
    delay = max(round(item.structure.delay_samples + series.delay), 0)
    left = replace(series, delay=item.structure.delay_samples + series.delay - delay)
    values = _with_residues(item.values, left.residues(item.values))
    structure = replace(item.structure, delay_samples=delay)
    return Grown.at(structure, values, item.response.records, item.point.most_noise)


@dataclass(frozen=True)
class _Series:
    """Poles in series: the integrator's residue, and samples of delay beyond that of the structure."""

    held: bool
    gain: float
    delay: float

    @classmethod
    def of(cls, values: CascadeValues, held: bool) -> _Series | None:
        """By all residues together; None where they are of no series."""
        poles, residues = _poles_and_residues(values)
        s, alone = cls(held, float(residues[0].real), 0.0)._terms(poles)
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = np.log(residues[1:] / alone[1:])
        if not np.isfinite(turned).all():
            return None
        delay = -float(np.sum((s[1:].conj() * turned).real) / np.sum(np.abs(s[1:]) ** 2))
        return cls(held, float(residues[0].real), delay)

    def residues(self, values: CascadeValues) -> ComplexArray:
        """In the order of `_poles_and_residues`; not finite where poles meet."""
        s, alone = self._terms(_poles_and_residues(values)[0])
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(alone * np.exp(-s * self.delay), np.complex128)

    def _terms(self, poles: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Logarithms of the poles, and the residues without a delay."""
        s = np.log(poles)
        s[0] = 0.0
        x = s if self.held else poles
        with np.errstate(divide="ignore", invalid="ignore"):
            found = 1 / np.prod(x[:, None] - x + np.eye(len(x)), axis=1)
            if self.held:
                found[1:] *= (poles[1:] - 1) / s[1:]
            return s, np.asarray(self.gain * found / found[0], np.complex128)


def _poles_and_residues(values: CascadeValues) -> tuple[ComplexArray, ComplexArray]:
    """Of the integrator, of every real pole, and of both poles of every section."""
    parts = [(np.ones(1), np.array([values.integrator_residue])), (values.real[0], values.real[1])]
    parts += [pair_of(section) for section in values.sections.T]
    poles, residues = zip(*parts, strict=True)
    return np.concatenate(poles).astype(complex), np.concatenate(residues).astype(complex)


def _with_residues(values: CascadeValues, residues: ComplexArray) -> CascadeValues:
    """The same poles with residues in the order of `_poles_and_residues`."""
    count = values.real.shape[1]
    real = np.array([values.real[0], residues[1 : 1 + count].real])
    sections = values.sections.copy()
    for section, own in zip(sections.T, residues[1 + count :].reshape(-1, 2), strict=True):
        section[2:] = section_of(pair_of(section)[0], own)[2:]
    return replace(values, integrator_residue=float(residues[0].real), real=real, sections=sections)
