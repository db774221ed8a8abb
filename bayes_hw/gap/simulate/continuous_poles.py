"""G in continuous time: the poles and residues whose zero-order-hold equivalent is the sampled G."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.compiled import compiled, compiled_inside

FASTEST_POLE = 1e-9
"""In z."""

AT_ONE = 1e-9
"""Distance from z = 1 within which a pole is an integrator."""


class ContinuousPoles(NamedTuple):
    """G as sum of residue / (s - pole) in continuous time, upper poles of each pair only; shapes (n,).

    `real` is one where the pole is real.
    """

    poles: ComplexArray
    residues: ComplexArray
    real: FloatArray

    def response(self, s: ComplexArray) -> ComplexArray:
        """G(s) at every `s` (points,)."""
        return np.asarray(_response(self.poles, self.residues, self.real, s))


def continuous_poles(
    real_poles: FloatArray,
    pair_poles: ComplexArray,
    real_residues: FloatArray,
    pair_residues: ComplexArray,
    rate: float,
) -> ContinuousPoles:
    """The continuous-time system whose zero-order-hold equivalent has the given poles and residues.

    A pole p = exp(s / rate) with residue r has the continuous residue r s / (p - 1). A negative pole is
    that of a pair at half the sample rate, both of which are seen at p; a pole at zero is taken for a very
    fast one.
    """
    return ContinuousPoles(
        *_continuous(real_poles, pair_poles, np.ascontiguousarray(real_residues), pair_residues, rate)
    )


@compiled
def _continuous(real_poles, pair_poles, real_residues, pair_residues, rate):  # type: ignore[no-untyped-def]
    """Poles, residues and whether they are real: positive ones, pairs, those at half the sample rate."""
    n_real, n_pairs = len(real_poles), len(pair_poles)
    poles = np.empty(n_real + n_pairs, np.complex128)
    residues = np.empty(n_real + n_pairs, np.complex128)
    real = np.zeros(n_real + n_pairs)
    found = 0
    for i in range(n_real):
        if real_poles[i] >= 0:
            poles[found], residues[found] = max(real_poles[i], FASTEST_POLE), real_residues[i]
            real[found] = 1.0
            found += 1
    for i in range(n_pairs):
        poles[found], residues[found] = pair_poles[i], pair_residues[i]
        found += 1
    for i in range(n_real):
        if real_poles[i] < 0:
            poles[found], residues[found] = real_poles[i], 0.5 * real_residues[i]
            found += 1
    for i in range(found):
        p = poles[i]
        if abs(p - 1) < AT_ONE:
            poles[i], residues[i] = 0.0, residues[i] * rate
        else:
            poles[i] = np.log(p) * rate
            residues[i] = residues[i] * (poles[i] / (p - 1))
    return poles, residues, real


@compiled_inside
def divided(one, other):  # type: ignore[no-untyped-def]
    """one / other, not a number where `other` is zero: complex division raises there in compiled code."""
    return one / other if other != 0 else complex(np.nan, np.nan)


@compiled
def _response(poles, residues, real, s):  # type: ignore[no-untyped-def]
    """sum residue / (s - pole) at every `s`, the conjugates of poles that are not `real` included."""
    found = np.zeros(len(s), dtype=np.complex128)
    for k in range(len(s)):
        for i in range(len(poles)):
            found[k] += divided(residues[i], s[k] - poles[i])
            if real[i] == 0:
                found[k] += divided(np.conj(residues[i]), s[k] - np.conj(poles[i]))
    return found
