"""Slow stochastic effects: a load torque by the wind, and an encoder that wanders.

- wind: first-order load torque through the drive train's own path, beside the encoder's noise
  (Davenport's spectrum falls likewise above its corner; doi 10.1002/qj.49708837618)
- sensor_drift (random walk): increments of constant variance a sample, beside the encoder's noise

The spectrum of the residuals gives the start (Whittle's likelihood), the Kalman filter the fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.noise_kernel import seen_part
from bayes_hw.gap.noise.spectra import (
    LARGEST_NOISE_CORRELATION,
    first_order_spectrum,
    fit_spectrum,
    mean_spectrum,
)
from bayes_hw.gap.noise.state_noise import CURVATURE_STEP, StateNoise, View, torque_noise, walking_noise
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.simulate.continuous_poles import ContinuousPoles
from bayes_hw.gap.simulate.path import Path

STATIC_HZ = 1e-3
EXACT_EVALUATIONS = 60
REFINING_EVALUATIONS = 30
"""From parameters that were fitted to nearly the same residuals."""

FIRST_STEP = 0.4
"""Of the logarithms of sizes and corners, in which a search for the most likely ones begins."""

VIEWS = 2
FIRST_ROUNDS = 2
"""Times that what shows of a disturbance is found from it, and that a search then goes on from there."""

NODES = 7
SMALLEST_DOUBT = 0.1
"""Of the encoder's noise; less is left out, since the filter takes longer where it changes."""

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(NODES)
_NORMAL_NODES = _NODES, _WEIGHTS / np.sum(_WEIGHTS)

HOPELESS = 5.0
"""Log-likelihood below autoregressive noise at the start beyond which a fit is not worth its time."""

Model: TypeAlias = Callable[[FloatArray], StateNoise]


def wind(
    fit: Misfit, start: FloatArray | None = None, doubts: Sequence[FloatArray] | None = None
) -> StochasticFit | None:
    """A slow load torque: first-order noise smoothed once more, through the drive train's own path.

    Inside the dead zone it does not show. The second corner is the size of the structure, which small gusts
    do not move (aerodynamic admittance). From `start` (5,) where given, else from the spectrum. `doubts`
    (samples,), a record each, is the variance of what else is in a sample, infinite where it is no reading.
    """
    rate, samples = fit.scale.rate, len(fit.residuals[0])
    path = fit.chain().torque_path
    if path is None:
        return None
    static = max(float(_load_compliance(path, np.array([STATIC_HZ]))[0]), 1e-300)
    lowest, highest = np.log(0.1 / (samples / rate)), np.log(0.15 * rate)

    def corners(p: FloatArray) -> tuple[float, float]:
        first = float(np.exp(np.clip(p[3], lowest, highest)))
        return first, first * float(1 + np.exp(np.clip(p[4], -3, 6)))

    motion, dead_zone = fit.motion()
    doubts = _with_unread(fit, doubts)
    rounds = FIRST_ROUNDS if start is None else 1
    own = [np.zeros(len(e)) for e in fit.residuals] if doubts is None else doubts
    at_rest = [
        View((np.abs(w) > dead_zone).astype(np.float64), doubt) for w, doubt in zip(motion, own, strict=True)
    ]

    def noise(p: FloatArray, views: Sequence[View] = at_rest) -> StateNoise:
        torque = float(np.exp(p[2])) / np.sqrt(static)
        plain = torque_noise(float(np.exp(p[0])), _correlation(p[1]), torque, corners(p), path, rate)
        return replace(plain, views=tuple(views))

    if start is None:
        spectrum = mean_spectrum(fit.residuals, rate)
        compliance = _load_compliance(path, spectrum.frequencies) / static

        def power(f: FloatArray, p: FloatArray) -> FloatArray:
            first, second = corners(p)
            slow = np.exp(2 * p[2]) * rate / (np.pi * first)
            slow = slow / ((1 + (f / first) ** 2) * (1 + (f / second) ** 2))
            return _encoder(f, p, rate) + slow * compliance

        high = np.log(np.sqrt(np.median(spectrum.power[-len(spectrum.power) // 4 :])))
        starts = [np.array([high, -1.0, np.log(fit.rmse), np.log(c), 2.0]) for c in (0.05, 0.3, 1.0)]
        p, _, whitener = _fitted(fit, noise, fit_spectrum(spectrum, power, starts), EXACT_EVALUATIONS)
    else:
        p, whitener = start, noise(start)
    for _ in range(rounds):
        for _ in range(VIEWS):
            swaying = [
                _view(w, *whitener.expected(e, record), dead_zone, whitener.sigma)
                for record, (w, e) in enumerate(zip(motion, fit.residuals, strict=True))
            ]
            views = [View(v.share, v.doubt + doubt) for v, doubt in zip(swaying, own, strict=True)]
            whitener = noise(p, views)
        p, sds, whitener = _fitted(fit, partial(noise, views=views), p)
    first, second = corners(p)
    return _found(
        "wind",
        "",
        fit,
        doubts,
        whitener,
        p,
        {
            "wind.sd": (float(np.exp(p[2])), float(np.exp(p[2]) * sds[2]), fit.scale.units.output),
            "wind.corner_hz": (first, first * float(sds[3]), "Hz"),
            "wind.second_corner_hz": (second, (second - first) * float(sds[4]), "Hz"),
        },
    )


def _view(w: FloatArray, sway: FloatArray, variance: FloatArray, dead_zone: float, sigma: float) -> View:
    """What the encoder, of noise `sigma`, sees of a disturbance of mean `sway` and `variance` added to w.

    Where it carries the axis into the dead zone or out of it, only a part shows: the share of it that comes
    nearest in the mean square (statistical linearisation: Gelb and Vander Velde, Multiple-Input Describing
    Functions, 1968), and the mean square of what is then missing. All but the last two are (samples,).
    """
    smallest = (SMALLEST_DOUBT * sigma) ** 2
    return View(*seen_part(w, sway, variance, dead_zone, smallest, *_NORMAL_NODES))


def random_walk(
    fit: Misfit, start: FloatArray | None = None, doubts: Sequence[FloatArray] | None = None
) -> StochasticFit:
    """A measured angle that wanders: increments of constant variance, beside the encoder's noise.

    From `start` (3,) where given, else from the spectrum; `doubts` as for `wind`.
    """
    doubts = _with_unread(fit, doubts)
    rate = fit.scale.rate
    duration = max(len(e) for e in fit.residuals) / rate

    def power(f: FloatArray, p: FloatArray) -> FloatArray:
        increments = 2 - 2 * np.cos(2 * np.pi * f / rate) + (0.3 / (duration * rate)) ** 2
        return _encoder(f, p, rate) + np.exp(2 * p[2]) / increments

    views = None
    if doubts is not None:
        views = tuple(View(np.ones_like(doubt), doubt) for doubt in doubts)

    def noise(p: FloatArray) -> StateNoise:
        walk = walking_noise(float(np.exp(p[0])), _correlation(p[1]), float(np.exp(p[2])))
        return replace(walk, views=views)

    if start is None:
        level = np.log(fit.rmse)
        starts = [np.array([level, -1.0, level + k]) for k in (-4.0, -2.5)]
        start = fit_spectrum(mean_spectrum(fit.residuals, rate), power, starts)
    p, sds, whitener = _fitted(fit, noise, start)
    step = float(np.exp(p[2]))
    unit = fit.scale.units.output
    return _found(
        "sensor_drift",
        "random walk",
        fit,
        doubts,
        whitener,
        p,
        {"sensor_drift.step_sd": (step, step * float(sds[2]), unit)},
    )


def _with_unread(fit: Misfit, doubts: Sequence[FloatArray] | None) -> Sequence[FloatArray] | None:
    """`doubts`, infinite where nothing was measured."""
    if fit.unread is None:
        return doubts
    own = [np.zeros(len(e)) for e in fit.residuals] if doubts is None else doubts
    return [np.where(mask, np.inf, doubt) for mask, doubt in zip(fit.unread, own, strict=True)]


def wandering_background(fit: Misfit) -> Whitener:
    """Noise of a random walk beside the encoder's, against which functions that name no cause are held.

    Where the spectrum gave a start that is hopeless, from one where half of every step is noise; where a walk
    still does not come near it, autoregressive noise.
    """
    found, plain = random_walk(fit), autoregression(fit)
    if found.log_likelihood < plain.log_likelihood - HOPELESS:
        steps = np.concatenate([np.diff(e) for e in fit.residuals])
        half = np.log(max(float(np.sqrt(np.mean(steps**2) / 2)), 1e-300))
        found = random_walk(fit, np.array([half, -1.0, half]))
    return found.whitener if found.log_likelihood > plain.log_likelihood - HOPELESS else plain


def _found(
    label: str,
    form: str,
    fit: Misfit,
    doubts: Sequence[FloatArray] | None,
    whitener: StateNoise,
    point: FloatArray,
    parameters: dict[str, tuple[float, float, str]],
) -> StochasticFit:
    beside = np.zeros(1) if doubts is None else np.concatenate(list(doubts))
    known = whitener.sigma**2 + float(np.mean(beside[np.isfinite(beside)]))
    size = float(np.sqrt(max(fit.rmse**2 - known, 0.0)))
    return StochasticFit(
        label,
        form,
        whitener,
        whitener.log_likelihood,
        parameters,
        encoder_sigma=whitener.sigma,
        size=size,
        point=point,
    )


def _encoder(f: FloatArray, p: FloatArray, rate: float) -> FloatArray:
    return first_order_spectrum(f, rate, float(np.exp(p[0])), _correlation(p[1]))


def _correlation(p: float) -> float:
    return LARGEST_NOISE_CORRELATION / (1 + float(np.exp(-np.clip(p, -30, 30))))


def _load_compliance(path: Path, f: FloatArray) -> FloatArray:
    """Squared response of w to the load's torque at frequencies f (Hz)."""
    real = np.arange(len(path.poles)) < path.real_count
    by_load = ContinuousPoles(path.poles, path.inputs[1] * path.outputs[0], real.astype(np.float64))
    s = np.asarray(2j * np.pi * f, dtype=np.complex128)
    return np.asarray(np.abs(by_load.response(s)) ** 2)


def _fitted(
    fit: Misfit, noise: Model, start: FloatArray, evaluations: int = REFINING_EVALUATIONS
) -> tuple[FloatArray, FloatArray, StateNoise]:
    """Parameters of most likelihood near `start`, their standard deviations, and the noise at them."""

    def cost(p: FloatArray) -> float:
        value = -noise(p).fitted_to(fit.residuals).log_likelihood
        return value if np.isfinite(value) else 1e300

    lowest = cost(start)
    if lowest > HOPELESS - autoregression(fit).log_likelihood:
        return start, np.ones(len(start)), noise(start).fitted_to(fit.residuals)
    found = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={
            "maxfev": evaluations,
            "fatol": 0.1,
            "xatol": 1e-3,
            "initial_simplex": np.vstack([start, start + FIRST_STEP * np.eye(len(start))]),
        },
    )
    best = np.asarray(found.x if found.fun < lowest else start)
    lowest = min(float(found.fun), lowest)
    sds = np.empty(len(best))
    for i in range(len(best)):
        step = np.zeros(len(best))
        step[i] = CURVATURE_STEP
        curvature = (cost(best + step) - 2 * lowest + cost(best - step)) / CURVATURE_STEP**2
        sds[i] = 1 / np.sqrt(max(curvature, 1.0))
    return best, sds, noise(best).fitted_to(fit.residuals)
