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

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import ComplexArray
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.growth.search import Grown

SAME_NATS = 1.0
"""That the delay may cost with all weights free."""

DOUBLE = 1e-9
"""Distance in z below which two poles are one."""


def without_zeros(item: Grown) -> Grown:
    """`item` at the delay at which its G has no zeros, its weights free; as it is where no such G explains as
    much but for what the criterion asks for the numbers that zeros would have."""
    if not item.structure.integrator or item.structure.order < 3:
        return item
    spared = item.structure.order - 2
    least = item.log_likelihood - 0.5 * spared * float(np.log(item.point.samples))
    found = []
    for held in (False, True):
        begun = in_series(item, held)
        if begun is None:
            continue
        # Weights that are free lead to the poles of that delay, of which the series is asked again.
        free = begun.descended()
        again = in_series(free, held)
        if again is not None and again.structure == free.structure and again.log_likelihood > least:
            found.append((again.log_likelihood, free))
    if not found:
        return item
    _, best = max(found, key=lambda one: one[0])
    return best if best.log_likelihood > item.log_likelihood - SAME_NATS else item


def in_series(item: Grown, held: bool) -> Grown | None:
    """`item` with the residues of its poles in series, at the delay that its own agree on best: of samples,
    or `held` in continuous time; None where its residues are of no series."""
    poles, residues = _poles_and_residues(item.values)
    apart = poles[:, None] - poles + np.eye(len(poles))
    if np.abs(apart).min() < DOUBLE:
        return None
    s = np.log(poles)
    s[0] = 0.0
    x = s if held else poles
    series = 1 / np.prod(x[:, None] - x + np.eye(len(x)), axis=1)
    if held:
        series[1:] *= (poles[1:] - 1) / s[1:]
    turned = np.log(residues[1:] / series[1:] * (series[0] / residues[0]))
    if not np.isfinite(turned).all():
        return None
    true_delay = item.structure.delay_samples - float(
        np.sum((s[1:].conj() * turned).real) / np.sum(np.abs(s[1:]) ** 2)
    )
    delay = max(round(true_delay), 0)
    own = residues[0] * series / series[0] * np.exp(s * (delay - true_delay))
    structure = replace(item.structure, delay_samples=delay)
    return Grown.at(structure, _with_residues(item.values, own), item.response.records, item.point.most_noise)


def _poles_and_residues(values: CascadeValues) -> tuple[ComplexArray, ComplexArray]:
    """Of the integrator, of every real pole, and of both poles of every section."""
    poles, residues = [1.0 + 0j, *values.real[0]], [values.integrator_residue + 0j, *values.real[1]]
    for a1, a2, b1, b2 in values.sections.T:
        root = np.sqrt(complex(a1 * a1 / 4 - a2)) or complex(DOUBLE)
        one, other = a1 / 2 + root, a1 / 2 - root
        poles += [one, other]
        residues += [(b1 * one + b2) / (one - other), (b1 * other + b2) / (other - one)]
    return np.array(poles, np.complex128), np.array(residues, np.complex128)


def _with_residues(values: CascadeValues, residues: ComplexArray) -> CascadeValues:
    """The same poles with residues in the order of `_poles_and_residues`."""
    count = values.real.shape[1]
    real = np.array([values.real[0], residues[1 : 1 + count].real])
    sections = values.sections.copy()
    pairs = residues[1 + count :].reshape(-1, 2)
    poles, _ = _poles_and_residues(values)
    for i, ((r1, r2), (p1, p2)) in enumerate(zip(pairs, poles[1 + count :].reshape(-1, 2), strict=True)):
        sections[2:, i] = (r1 + r2).real, -(r1 * p2 + r2 * p1).real
    return replace(values, integrator_residue=float(residues[0].real), real=real, sections=sections)
