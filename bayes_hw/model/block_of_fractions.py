"""A linear block of partial fractions: zeros that hold where poles lie close together.

On one denominator the numerator's coefficients lose their digits to cancellation, and with fourteen poles
about z = 1 the zeros found from them are no zeros any more. Those of the state-space form are perturbed no
more than every pole alone would be: they are the finite z at which [[A - z I, B], [C, D]] is singular
(Emami-Naeini and Van Dooren, doi 10.1016/0005-1098(82)90070-X).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.linear import LinearBlock

NEGLIGIBLE = 1e-12
"""Samples of the impulse response this small beside what cancels in them are rounding errors."""


def block_of_fractions(
    real: FloatArray, sections: FloatArray, direct: float, poles: ComplexArray, delay_samples: int
) -> LinearBlock:
    """`direct` + sum_i r_i / (z - p_i) + sum_k (b1 z + b2) / (z^2 - a1 z + a2) behind a delay, as zeros, the
    given poles (n,) and gain.

    `real` (2, m) holds poles and residues, `sections` (4, k) a1, a2, b1, b2; n = m + 2 k.
    """
    a = linalg.block_diag(
        np.zeros((0, 0)), *real[0].reshape(-1, 1, 1), *[[[a1, -a2], [1.0, 0.0]] for a1, a2 in sections[:2].T]
    )
    b = np.concatenate([np.ones(real.shape[1]), np.tile([1.0, 0.0], sections.shape[1])])
    c = np.concatenate([real[1], sections[2:].T.ravel()])
    order = len(b)
    gain, degree, state, cancelling = direct, order, b, float(np.abs(c) @ b)
    while abs(gain) <= NEGLIGIBLE * cancelling and degree > 0:
        gain, cancelling = float(c @ state), float(np.abs(c) @ np.abs(state))
        state, degree = a @ state, degree - 1
    pencil = np.block([[a, b[:, None]], [c[None], np.array([[direct]])]])
    alpha, beta = linalg.eigvals(
        pencil, np.diag([*np.ones(order), 0.0]), homogeneous_eigvals=True, check_finite=False
    )
    nearest = np.argsort(np.arctan2(np.abs(alpha), np.abs(beta)))[:degree]
    return LinearBlock(alpha[nearest] / beta[nearest], poles, gain, delay_samples)
