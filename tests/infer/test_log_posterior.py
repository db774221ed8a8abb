"""The log-posterior equals one written again with scipy's filter, covariance matrix and distributions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg, signal, stats
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record

NOISE = NoiseEstimate(0.012, np.array([0.4, -0.2]))


def posterior_of(model: HammersteinWiener, records: list[Record]) -> LogPosterior:
    axis = AxisParameters(model, output_scale=2.0)
    return LogPosterior(axis, noise_parameters(NOISE, "deg"), records)


def plain_log_likelihood(model: HammersteinWiener, record: Record, values: dict[str, float]) -> float:
    """Direct-form filter of the cascade, dense covariance of the AR(2) noise."""
    rate = model.sample_rate_hz
    modes = [name.split(".")[0] for name in values if name.endswith("frequency_hz")]
    poles = [1.0 + 0j]
    for mode in modes:
        omega, zeta = 2 * np.pi * values[f"{mode}.frequency_hz"], values[f"{mode}.damping_ratio"]
        s = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
        poles += [np.exp(s / rate), np.exp(s / rate).conjugate()]
    b, a = signal.zpk2tf(model.linear.zeros, poles, values["gain"])
    b = np.r_[np.zeros(len(a) - len(b)), b] if len(b) < len(a) else b
    v = np.clip(record.u, values["saturation.lower"], values["saturation.upper"])
    v = np.r_[np.zeros(model.linear.delay_samples), v][: len(v)]
    w = signal.lfilter(b, a, v)
    delta = values["dead_zone.half_width"]
    y = np.sign(w) * np.maximum(np.abs(w) - delta, 0)
    k1 = values["noise.partial_autocorrelation1"]
    k2 = values["noise.partial_autocorrelation2"]
    phi = np.array([k1 * (1 - k2), k2])
    correlation = [1.0, k1]
    while len(correlation) < len(y):
        correlation.append(float(phi @ [correlation[-1], correlation[-2]]))
    covariance = values["noise.sigma"] ** 2 * linalg.toeplitz(correlation)
    return float(stats.multivariate_normal(np.zeros(len(y)), covariance).logpdf(record.y - y))


def plain_log_prior(model: HammersteinWiener, values: dict[str, float]) -> float:
    """Densities of the coordinates: log-normal parameters are normal in theirs, the others by Jacobian."""
    total = 0.0
    for name, value in values.items():
        if name == "dead_zone.half_width":
            scale = 3 * model.dead_zone.half_width
            total += stats.halfnorm(scale=scale).logpdf(value) + np.log(value)
        elif name.startswith("noise.partial"):
            total += np.log(0.5) + np.log(1 - value**2)
        else:
            nominal, log_sd = {
                "saturation.lower": (model.saturation.lower, 0.3),
                "saturation.upper": (model.saturation.upper, 0.3),
                "gain": (model.linear.gain, 0.3),
                "noise.sigma": (NOISE.sigma, 1.5),
            }.get(name, (None, None))
            if name.startswith("mode"):
                mode = model.dominant_modes[int(name[4]) - 1]
                frequency = name.endswith("_hz")
                nominal = mode.frequency_hz if frequency else mode.damping_ratio
                log_sd = 0.1 if frequency else 0.8
            total += stats.norm(np.log(abs(nominal)), log_sd).logpdf(np.log(abs(value)))
    return float(total)


def around(posterior: LogPosterior, walkers: int, spread: float, seed: int) -> FloatArray:
    """Coordinates (walkers, parameters) scattered about the nominal values."""
    nominal = posterior.coordinates(np.array([p.nominal for p in posterior.parameters]))
    return nominal + spread * np.random.default_rng(seed).standard_normal((walkers, len(nominal)))


def test_equals_a_plain_implementation(small_axis: HammersteinWiener) -> None:
    """Two records of different length, 20 walkers far from and near the truth, 1e-9 relative."""
    records = [measured(small_axis, 300, seed=1), measured(small_axis, 170, seed=2)]
    posterior = posterior_of(small_axis, records)
    coordinates = np.concatenate([around(posterior, 10, 0.03, 1), around(posterior, 10, 0.3, 2)])
    found = posterior(coordinates)
    for i, values in enumerate(posterior.values(coordinates)):
        named = dict(zip(posterior.names, values.tolist(), strict=True))
        expected = plain_log_prior(small_axis, named)
        expected += sum(plain_log_likelihood(small_axis, record, named) for record in records)
        assert found[i] == pytest.approx(expected, rel=1e-9)
    assert posterior.non_finite == 0


def test_names_and_round_trip(small_axis: HammersteinWiener, small_record: Record) -> None:
    posterior = posterior_of(small_axis, [small_record])
    assert posterior.names == (
        *("saturation.lower", "saturation.upper", "dead_zone.half_width", "gain"),
        *("mode1.frequency_hz", "mode1.damping_ratio"),
        *("noise.sigma", "noise.partial_autocorrelation1", "noise.partial_autocorrelation2"),
    )
    assert posterior.dimension == 9 and posterior.order == 2
    coordinates = around(posterior, 12, 0.5, 3).reshape(3, 4, 9)
    np.testing.assert_allclose(
        posterior.coordinates(posterior.values(coordinates)), coordinates, rtol=1e-12, atol=1e-12
    )


@pytest.fixture(scope="module")
def two_modes(small_axis: HammersteinWiener) -> HammersteinWiener:
    modes = (Mode(2.0, 0.1), Mode(2.2, 0.1))
    pairs = [mode.pole(20.0) for mode in modes]
    poles = np.array([1.0, *pairs, *[pole.conjugate() for pole in pairs]])
    linear = LinearBlock(np.array([0.3 + 0j]), poles, 0.02, 1)
    return replace(small_axis, linear=linear, dominant_modes=modes)


def test_disordered_modes_are_impossible(two_modes: HammersteinWiener) -> None:
    """Swapping the two modes leaves the axis as it is: only one of the two labellings may count."""
    posterior = posterior_of(two_modes, [measured(two_modes, 100, seed=4)])
    values = np.array([p.nominal for p in posterior.parameters])
    swapped = values.copy()
    swapped[[4, 5, 6, 7]] = values[[6, 7, 4, 5]]
    log_density = posterior(posterior.coordinates(np.stack([values, swapped])))
    assert np.isfinite(log_density[0]) and log_density[1] == -np.inf
    assert posterior.log_likelihood(np.stack([values, swapped]).T) == pytest.approx(
        posterior.log_likelihood(values[:, None])[0], rel=1e-9
    )
    assert posterior.non_finite == 0


def test_a_walker_out_of_support_does_not_touch_the_others(
    small_axis: HammersteinWiener, small_record: Record
) -> None:
    """NaN and infinite coordinates are impossible, silently, and their neighbours keep their bits."""
    posterior = posterior_of(small_axis, [small_record])
    coordinates = around(posterior, 40, 0.05, 5)
    expected = posterior(coordinates)
    broken = coordinates.copy()
    broken[3, 0], broken[11, 2], broken[20, 6] = np.nan, np.inf, -np.inf
    found = posterior(broken)
    bad = np.isin(np.arange(40), [3, 11, 20])
    assert (found[bad] == -np.inf).all()
    np.testing.assert_array_equal(found[~bad], expected[~bad])


def test_non_finite_likelihoods_are_counted(small_axis: HammersteinWiener, small_record: Record) -> None:
    """A partial autocorrelation that rounds to one has no likelihood: impossible, and counted."""
    posterior = posterior_of(small_axis, [small_record])
    coordinates = around(posterior, 6, 0.05, 6)
    coordinates[[1, 4], 7] = 19.5
    found = posterior(coordinates)
    assert (found[[1, 4]] == -np.inf).all() and np.isfinite(np.delete(found, [1, 4])).all()
    assert posterior.non_finite == 2


def test_free_start_places_the_record(small_axis: HammersteinWiener) -> None:
    """A record that stands still from its start is fitted exactly by its first output."""
    still = replace(measured(small_axis, 200, seed=7), u=np.zeros(200))
    moved = replace(still, y=small_axis.simulate(still.u, 3.0).y)
    axis = AxisParameters(small_axis, output_scale=2.0, start_positions=moved.y[:1])
    free = LogPosterior(axis, noise_parameters(NOISE, "deg"), [moved])
    values = np.array([p.nominal for p in free.parameters])
    assert values[free.names.index("start1.position")] == pytest.approx(moved.y[0])
    at_rest = posterior_of(small_axis, [replace(still, y=np.zeros(200))])
    nominal = np.array([p.nominal for p in at_rest.parameters])
    exact = at_rest.log_likelihood(nominal[:, None])[0]
    assert free.log_likelihood(values[:, None])[0] == pytest.approx(exact, rel=1e-9)
