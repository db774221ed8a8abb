"""The formulas that a report may show, in Typst math, each with its reading in words.

Equation numbers are those of Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012.
"""

from __future__ import annotations

from bayes_hw.report.page.document import Formula

CASCADE = Formula(
    "y(k) = n(w(k)), quad w(k) = G(z) v(k), quad v(k) = f(u(k))",
    "y of k is n of w of k; w of k is G of z applied to v of k; v of k is f of u of k",
)
"""The cascade (eq. 4)."""

SATURATION = Formula(
    "f(u) = cases(s_+ quad & u > s_+, u & s_- <= u <= s_+, s_- & u < s_-)",
    "f of u is u between the limits s minus and s plus, and the nearer limit outside",
)
"""Saturation with unequal limits and unit gain (eq. 1)."""

LINEAR_BLOCK = Formula(
    "G(z) = g z^(-d) (product_i (z - z_i)) / (product_j (z - p_j))",
    "G of z is g times z to the minus d times the product of z minus each zero, "
    "divided by the product of z minus each pole",
)
"""The linear block by its zeros, poles, gain and delay (eq. 2)."""

MODE_POLE = Formula(
    "p_(1,2) = exp((2 pi f) / f_s (-zeta plus.minus i sqrt(1 - zeta^2)))",
    "the pole pair of a mode is the exponential of 2 pi f over the sample rate times minus zeta "
    "plus or minus i times the square root of one minus zeta squared",
)
"""The pole pair of a mode of frequency f and damping ratio zeta at the sample rate f_s."""

DEAD_ZONE = Formula(
    "n(w) = cases(w - delta quad & w > delta, 0 & abs(w) <= delta, w + delta & w < -delta)",
    "n of w is zero where the magnitude of w is at most delta; w minus delta above; w plus delta below",
)
"""Dead zone of half width delta and unit gains (eq. 5)."""

NOISE = Formula(
    "e(k) = sum_i phi_i e(k - i) + a(k), quad a(k) tilde.op N(0, sigma_a^2)",
    "the noise e of k is the sum over i of phi i times e of k minus i, plus the innovation a of k, "
    "which is normal with mean zero and variance sigma a squared",
)
"""Autoregressive noise added to the output."""

FIT = Formula(
    'upright("fit") = 100 % (1 - norm(y - hat(y)) / norm(y - overline(y)))',
    "the fit is 100 per cent times one minus the norm of the prediction error over the norm of "
    "the output about its mean",
)
"""The fit of a predicted record, as the paper computes it."""

SCALING_GROUP = Formula(
    "v -> a v, quad w -> b w: quad (c_1, s_-, s_+) -> a (c_1, s_-, s_+), quad g -> b / a g, quad "
    "(delta_+, delta_-) -> b (delta_+, delta_-), quad (c_2, c_3) -> (c_2, c_3) / b",
    "v becomes a times v and w b times w when c 1 and both limits are multiplied by a, the gain g by b over "
    "a, both thresholds by b, and c 2 and c 3 are divided by b",
)
"""The scaling group of the gains."""

INFORMATION_GAIN = Formula(
    "U = 1/2 (log det C_psi - EE_theta log det C_psi (theta)), quad C(theta) = (P(theta) + F(theta))^(-1)",
    "the expected gain U is half the log-determinant of the covariance of psi before, less half the "
    "expectation over theta of that after, which is the inverse of what was known near theta plus the "
    "Fisher information of the experiment there",
)
"""The Laplace approximation of the expected information gain."""
