"""Noise with a state: encoder noise with a random walk, or with a slow load torque, as a linear system.

The Kalman filter gives the exact likelihood from the first sample on (Durbin and Koopman, Time Series
Analysis by State Space Methods, section 7.2), where a long autoregression has no past to start from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.noise.noise_kernel import state_filter, state_gains
from bayes_hw.gap.noise.whitener import LOG_2PI, Homogeneous
from bayes_hw.gap.simulate.columns import count_finite, filled_out, part, square_sums
from bayes_hw.gap.simulate.path import Path
from bayes_hw.model.lanes import padded_to_lanes

ENCODER_PARAMETERS = 2
"""Of the encoder's noise; those of the effect are counted with it."""

CURVATURE_STEP = 0.05
"""Of the logarithms of noise parameters, at which the curvature of a likelihood is taken."""


class View(NamedTuple):
    """The share of a disturbance that shows (samples,), and the variance (samples,) of what more may show.

    The variance is infinite where there is no reading. `strength` (samples,), one if None, is what the
    variance of the disturbance's increments is multiplied by.
    """

    share: FloatArray
    doubt: FloatArray
    strength: FloatArray | None = None

    @classmethod
    def everywhere(cls, samples: int) -> View:
        """Of a disturbance that always shows."""
        return cls(np.ones(samples), np.zeros(samples))


class Gains(NamedTuple):
    """What the filter of one record needs, whatever it filters, as `state_gains` fills it.

    The `share` (samples,) that shows, `gains` (samples, n), the innovations' standard deviations `roots` and
    the disturbance's `variances` (samples,), the log-determinant of the innovations' variances.
    """

    share: FloatArray
    gains: FloatArray
    roots: FloatArray
    variances: FloatArray
    log_determinant: float


@dataclass(frozen=True)
class StateNoise(Homogeneous):
    """x(k+1) = transition x(k) + a(k), noise(k) = output x(k); x(0) of variance `initial`; n states.

    The last state is the encoder's own noise of standard deviation `sigma`, output units; where a `view` of
    the record says that the disturbance does not show, it shows alone.
    """

    transition: FloatArray
    output: FloatArray
    increment: FloatArray
    initial: FloatArray
    sigma: float
    log_likelihood: float = float("nan")
    parameter_count: int = ENCODER_PARAMETERS
    views: tuple[View, ...] | None = None
    _known_gains: dict[tuple[int, int], Gains] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def correlation(self) -> float:
        return float(self.transition[-1, -1])

    @property
    def with_states(self) -> StateNoise:
        return self

    def with_encoder(self, sigma: float) -> StateNoise:
        """The same with the encoder's own noise of standard deviation `sigma`, its correlation kept."""
        increment, initial = self.increment.copy(), self.initial.copy()
        increment[-1, -1] = sigma**2 * (1 - self.correlation**2)
        initial[-1, -1] = sigma**2
        return replace(self, increment=increment, initial=initial, sigma=sigma)

    def weaker(self, share: float) -> StateNoise:
        """The same with a disturbance of `share` of its variance beside the encoder's own noise."""
        increment, initial, views = self.increment.copy(), self.initial.copy(), self.views
        increment[:-1, :-1] *= share
        initial[:-1, :-1] *= share
        if views is not None:
            views = tuple(v._replace(doubt=v.doubt * share) for v in views)
        return replace(self, increment=increment, initial=initial, views=views)

    def whiten(self, columns: FloatArray, record: int) -> FloatArray:
        return self._filtered(columns, record)[0]

    def hidden(self, residuals: Sequence[FloatArray]) -> list[BoolArray]:
        if self.views is None:
            return super().hidden(residuals)
        return [np.asarray((view.share < 1) | (view.doubt > 0)) for view in self.views]

    def expected(self, residual: FloatArray, record: int) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (samples,) of the disturbance, given the residuals before each sample."""
        _, mean = self._filtered(residual[:, None], record)
        return mean[:, 0], self._gains(record, len(residual)).variances

    def innovations(self, residual: FloatArray, record: int) -> tuple[FloatArray, FloatArray]:
        """Of residuals (samples,), both (samples,): unit innovations and their standard deviations, output
        units, infinite where a sample was not read."""
        white, _ = self._filtered(residual[:, None], record)
        return white[:, 0], self._gains(record, len(residual)).roots

    def _filtered(self, columns: FloatArray, record: int) -> tuple[FloatArray, FloatArray]:
        """White columns and the disturbance expected in each, both (samples, n)."""
        samples, count = columns.shape
        wide = padded_to_lanes(count) if count > 1 else count
        padded = np.ascontiguousarray(columns) if count == wide else filled_out(columns, wide)
        white, expected = np.empty_like(padded), np.empty_like(padded)
        found = self._gains(record, samples)
        state_filter(
            padded, self.transition, self.output, found.share, found.gains, found.roots, white, expected
        )
        if count == wide:
            return white, expected
        return part(white, 0, count), part(expected, 0, count)

    def _gains(self, record: int, samples: int) -> Gains:
        """Those of one record, worked out when they are first asked for."""
        key = (0 if self.views is None else record, samples)
        if key not in self._known_gains:
            self._known_gains[key] = self._new_gains(*key)
        return self._known_gains[key]

    def _new_gains(self, record: int, samples: int) -> Gains:
        view = View.everywhere(samples) if self.views is None else self.views[record]
        gains, roots = np.empty((samples, len(self.output))), np.empty(samples)
        variances = np.empty(samples)
        log_determinant = state_gains(
            self.transition,
            self.output,
            view.share,
            view.doubt,
            np.ones(samples) if view.strength is None else view.strength,
            self.increment,
            self.initial,
            gains,
            roots,
            variances,
        )
        return Gains(view.share, gains, roots, variances, float(log_determinant))

    def fitted_to(self, residuals: Sequence[FloatArray]) -> StateNoise:
        """The same with its log-likelihood of `residuals`, an array (samples,) a record."""
        total = 0.0
        for record, e in enumerate(residuals):
            white, _ = self._filtered(e[:, None], record)
            log_determinant = self._gains(record, len(e)).log_determinant
            readings = len(e)
            if self.views is not None:
                readings = count_finite(self.views[record].doubt)
            total -= 0.5 * (readings * LOG_2PI + log_determinant + float(square_sums(white)[0]))
        return replace(self, log_likelihood=total)


def _with_encoder(
    transition: FloatArray,
    output: FloatArray,
    increment: FloatArray,
    initial: FloatArray,
    sigma: float,
    correlation: float,
) -> StateNoise:
    """A disturbance with first-order encoder noise of marginal `sigma` beside it."""
    return StateNoise(
        _with_one_more(transition, correlation),
        np.append(output, 1.0),
        _with_one_more(increment, sigma**2 * (1 - correlation**2)),
        _with_one_more(initial, sigma**2),
        sigma,
    )


def _with_one_more(matrix: FloatArray, last: float) -> FloatArray:
    """The square matrix with `last` below its diagonal (scipy's block_diag takes longer than the rest)."""
    count = len(matrix)
    larger = np.zeros((count + 1, count + 1))
    larger[:count, :count] = matrix
    larger[count, count] = last
    return larger


def walking_noise(sigma: float, correlation: float, step_sd: float) -> StateNoise:
    """Encoder noise beside a random walk from zero, `step_sd` a sample, all in output units."""
    one = np.ones((1, 1))
    return _with_encoder(one, np.ones(1), step_sd**2 * one, 0 * one, sigma, correlation)


def torque_noise(
    sigma: float,
    correlation: float,
    torque_sd: float,
    corners_hz: tuple[float, float],
    path: Path,
    rate: float,
) -> StateNoise:
    """Encoder noise beside a load torque through the drive train, which starts at rest.

    The torque is first-order noise of `torque_sd` (units of the load's acceleration) with the first of
    `corners_hz`, smoothed by a first-order low-pass with the second.
    """
    n, m = path.shape
    states = 2 + n + 2 * m
    slow, fast = (2 * np.pi * corner for corner in corners_hz)
    motion = np.zeros((states, states))
    motion[0, 0] = -slow
    motion[1, :2] = fast, -fast
    output = np.zeros(states)
    for i in range(n):
        motion[2 + i, 2 + i] = path.poles[i].real
        motion[2 + i, 1] = path.inputs[1, i].real
        output[2 + i] = path.outputs[0, i].real
    for i in range(m):
        at = 2 + n + 2 * i
        s, gain = path.poles[n + i], 2 * path.inputs[1, n + i] * path.outputs[0, n + i]
        motion[at : at + 2, at : at + 2] = [[s.real, -s.imag], [s.imag, s.real]]
        motion[at : at + 2, 1] = [gain.real, gain.imag]
        output[at] = 1.0
    spread = np.zeros((states, states))
    spread[0, 0] = 2 * slow * torque_sd**2
    transition, increment = _sampled(motion, spread, 1 / rate)
    initial = np.zeros((states, states))
    share = slow / (slow + fast)
    initial[:2, :2] = torque_sd**2 * np.array([[1.0, 1 - share], [1 - share, 1 - share]])
    return _with_encoder(transition, output, increment, initial, sigma, correlation)


def _sampled(motion: FloatArray, spread: FloatArray, h: float) -> tuple[FloatArray, FloatArray]:
    """Transition and variance of the increments over h seconds (doi 10.1109/TAC.1978.1101743).

    Worked out for a short step and doubled: backwards in time, fast poles would overflow.
    """
    states = len(motion)
    fastest = float(np.abs(np.linalg.eigvals(motion)).max())
    halvings = max(0, int(np.ceil(np.log2(max(fastest * h, 1e-9)))) + 2)
    doubled = np.zeros((2 * states, 2 * states))
    doubled[:states, :states], doubled[:states, states:], doubled[states:, states:] = (
        -motion,
        spread,
        motion.T,
    )
    both = expm(doubled * h / 2**halvings)
    transition = both[states:, states:].T
    increment = transition @ both[:states, states:]
    for _ in range(halvings):
        increment = increment + transition @ increment @ transition.T
        transition = transition @ transition
    return transition, 0.5 * (increment + increment.T)
