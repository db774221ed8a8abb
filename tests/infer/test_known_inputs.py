"""Known inputs of a model: the likelihood is the dense one, files keep them, gain and delay are estimated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, stats
from simulated_records import measured

from bayes_hw.errors import InputError
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.prediction import predict
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.known_input import KnownInput, Way, polar
from bayes_hw.record import Record

POLES = np.array([0.9 + 0.2j, 0.9 - 0.2j, 0.5], dtype=np.complex128)
CYCLES = 0.02
LATE = np.exp(-2j * np.pi * CYCLES)
UNSCALED = np.array([0.1 - 0.05j, 0.1 + 0.05j, 0.2], dtype=np.complex128)
RESIDUES = UNSCALED / polar(complex(np.sum(UNSCALED * LATE / (1 - POLES * LATE))), CYCLES, 0.0)[0]


def with_wind(
    model: HammersteinWiener, way: Way, gain: float = 0.08, delay: float = 3.4
) -> HammersteinWiener:
    poles, residues = (POLES, RESIDUES) if way == "torque" else (POLES[:0], RESIDUES[:0])
    return replace(model, known=(KnownInput("wind", way, gain, delay, CYCLES, "m/s", poles, residues),))


def record_of(model: HammersteinWiener, samples: int, seed: int) -> Record:
    rng = np.random.default_rng(seed)
    quiet = measured(replace(model, known=()), samples, seed)
    noise = quiet.y - replace(model, known=()).simulate(quiet.u).y
    wind = 4 + np.cumsum(rng.standard_normal(samples)) * 0.1
    known = {"wind": wind}
    y = model.simulate(quiet.u, known=known).y + noise
    return replace(quiet, y=y, known=known, known_units={"wind": "m/s"})


@pytest.mark.parametrize("way", ["torque", "reading"])
@pytest.mark.parametrize("degrees", [None, 5.0])
def test_likelihood_with_a_known_input(
    small_axis: HammersteinWiener, way: Way, degrees: float | None
) -> None:
    """At the model's own delay the response is exact: a dense normal, holes left out, or, for Student t, the
    same as of a record from which the known input's part has been taken."""
    model = with_wind(small_axis, way)
    record = record_of(model, 160, 3)
    mask = np.random.default_rng(1).random(160) > 0.1
    record = replace(record, measured=mask)
    estimate = NoiseEstimate(0.012, np.array([0.5]), degrees)
    axis = AxisParameters(model, output_scale=2.0)
    weights = 3 if way == "torque" else 2
    assert axis.names[-1] == f"known.wind.weight{weights}"
    target = LogPosterior(axis, noise_parameters(estimate, "deg"), [record])
    values = np.array([p.nominal for p in target.parameters])[:, None] * np.ones(2)
    (rows,) = axis.known_rows
    values[rows, 1] *= 0.05 / 0.08
    found = target.log_likelihood(values)
    for i, gain in enumerate((0.08, 0.05)):
        own = with_wind(small_axis, way, gain)
        e = record.y - own.simulate(record.u, known=record.known).y
        assert axis.to_model(values[: len(axis.names), i]).known[0].gain == pytest.approx(gain)
        if degrees is None:
            covariance = 0.012**2 * linalg.toeplitz(0.5 ** np.arange(160))[np.ix_(mask, mask)]
            expected = stats.multivariate_normal(np.zeros(mask.sum()), covariance).logpdf(e[mask])
        else:
            bare = replace(small_axis, known=())
            plain = replace(record, y=bare.simulate(record.u).y + e)
            other = LogPosterior(AxisParameters(bare, output_scale=2.0), target.noise, [plain])
            kept = np.delete(values, rows, axis=0)
            expected = other.log_likelihood(kept)[i]
        assert found[i] == pytest.approx(expected, rel=1e-7)


def test_gain_and_lag_are_estimated(small_axis: HammersteinWiener) -> None:
    """From a model whose gain is 30 % and whose delay is a sample off, so that the shape must follow: gain
    and lag at the column's typical frequency within four widths of the truth's, in each of three sets."""
    truth = with_wind(small_axis, "torque")
    for seeds in ((1, 2), (3, 4), (5, 6)):
        records = [record_of(truth, 900, seed) for seed in seeds]
        axis = AxisParameters(with_wind(small_axis, "torque", 0.056, 2.4), output_scale=2.0)
        found = starting_point(axis, records, np.random.default_rng(1))
        target = LogPosterior(axis, found.noise_parameters, records)
        draws = np.random.default_rng(2).multivariate_normal(found.coordinates, found.covariance, 200)
        strengths = axis.known_strengths(target.values(draws).T[: len(axis.names)])
        for name, expected in (("gain", 0.08), ("lag_s", truth.known[0].lag_samples / 20)):
            drawn, _ = strengths[f"known.wind.{name}"]
            assert abs(drawn.mean() - expected) < 4 * drawn.std()
            assert drawn.std() < 0.1 * abs(expected)


def test_files_keep_known_inputs_and_need_their_column(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    model = with_wind(small_axis, "torque")
    model.write(tmp_path / "model.json")
    back = HammersteinWiener.read(tmp_path / "model.json")
    record = record_of(model, 200, 5)
    np.testing.assert_allclose(
        back.simulate(record.u, known=record.known).y,
        model.simulate(record.u, known=record.known).y,
        rtol=1e-12,
    )
    assert "known" not in small_axis.to_dict()
    with pytest.raises(InputError, match="--known wind"):
        back.simulate(record.u, known={})
    data = model.to_dict()
    data["known"][0]["poles"][0] = [1.2, 0.0]
    with pytest.raises(InputError, match="known"):
        HammersteinWiener.from_dict(data)


def test_prediction_follows_the_column(small_axis: HammersteinWiener) -> None:
    """The draws' outputs hold the known input's part, block by block or not; a column missing is refused."""
    model = with_wind(small_axis, "torque")
    record = record_of(model, 300, 7)
    axis = AxisParameters(model, output_scale=2.0)
    estimate = NoiseEstimate(0.012, np.array([0.5]))
    parameters = (*axis.parameters, *noise_parameters(estimate, "deg"))
    values = np.broadcast_to([p.nominal for p in parameters], (1, 2, 20, len(parameters))).copy()
    posterior = Posterior(
        axis, noise_parameters(estimate, "deg"), values, np.zeros((1, 2, 20)), values[0, 0, 0], True, (), 1.0
    )
    found = predict(posterior, record, np.random.default_rng(1))
    np.testing.assert_allclose(found.mean, model.simulate(record.u, known=record.known).y, atol=1e-9)
    assert posterior.derived["known.wind.gain"].mean == pytest.approx(0.08)
    assert list(posterior.reported).index("known.wind.lag_s") < list(posterior.reported).index("noise.sigma")
    with pytest.raises(InputError, match="wind"):
        predict(posterior, replace(record, known={}), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("through", "gain", "turns"),
    [(2.0, 2.0, 0.0), (-3j, 3.0, 0.25), (3j, -3.0, 0.25), (-1.0, -1.0, 0.0), (np.exp(-1j), 1.0, 0.5 / np.pi)],
)
def test_springs_and_integrators_keep_their_sign(through: complex, gain: float, turns: float) -> None:
    """A torque that an integrator takes lags by a quarter of a turn, in whatever noise; it does not lead."""
    for turn in np.random.default_rng(4).uniform(-0.1, 0.1, 50):
        found, lag = polar(complex(through) * np.exp(2j * np.pi * turn), CYCLES, 3.0)
        assert found == pytest.approx(gain)
        assert lag == pytest.approx(3.0 + (turns - turn) / CYCLES)
