"""A posterior survives its files, says what it must in them, and refuses what is not one."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from arviz_stats.base import array_stats
from drawn_posterior import ENSEMBLES, STEPS, WALKERS, posterior_of

from bayes_hw.errors import InputError
from bayes_hw.format_names import POSTERIOR
from bayes_hw.identify.noise import autoregression_from_partial
from bayes_hw.infer.posterior import STORED_DRAWS, Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Record


@pytest.fixture(scope="module")
def posterior(small_axis: HammersteinWiener) -> Posterior:
    return posterior_of(small_axis)


@pytest.fixture(scope="module")
def folder(posterior: Posterior, small_record: Record, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("posterior")
    posterior.write(path, [small_record])
    return path


@pytest.mark.parametrize("start", [None, np.array([1.5, -0.3])])
def test_written_and_read_back(
    small_axis: HammersteinWiener, tmp_path: Path, start: np.ndarray | None
) -> None:
    """To the bit: draws, log-probability, parameters with their priors, and what was said of them."""
    written = posterior_of(small_axis, start=start)
    written.write(tmp_path)
    found = Posterior.read(tmp_path)
    np.testing.assert_array_equal(found.values, written.values)
    np.testing.assert_array_equal(found.log_probability, written.log_probability)
    np.testing.assert_array_equal(found.point_estimate, written.point_estimate)
    assert found.names == written.names
    assert found.noise_order == 2
    for one, other in zip(found.parameters, written.parameters, strict=True):
        assert one.prior.describe(one.unit) == other.prior.describe(other.unit)
    assert (found.converged, found.problems, found.seconds) == (False, ("too short",), 1.25)
    assert found.axis.model.to_dict() == written.axis.model.to_dict()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["posterior.json", "posterior.nc"]


def test_json_has_the_agreed_keys(folder: Path, posterior: Posterior) -> None:
    data = json.loads((folder / "posterior.json").read_text())
    assert data["schema"] == POSTERIOR == "bayes-hw/posterior/1"
    assert data["converged"] is False and data["seconds"] == 1.25
    required = {"mean", "sd", "median", "hdi94", "ess_bulk", "ess_tail", "r_hat", "mcse_mean", "unit"}
    names = (
        *("saturation.lower", "saturation.upper", "dead_zone.half_width", "gain"),
        *("mode1.frequency_hz", "mode1.damping_ratio", "noise.sigma"),
    )
    for name in names:
        entry = data["parameters"][name]
        assert required <= set(entry)
        draws = posterior.chains(name)
        assert entry["mean"] == pytest.approx(draws.mean())
        low, high = entry["hdi94"]
        assert low < entry["median"] < high
        assert np.mean((draws >= low) & (draws <= high)) == pytest.approx(0.94, abs=0.001)
    units = {name: data["parameters"][name]["unit"] for name in names}
    assert units["saturation.lower"] == "deg/s" and units["dead_zone.half_width"] == "deg"
    assert units["mode1.frequency_hz"] == "Hz" and units["noise.sigma"] == "deg"


def test_arviz_reads_the_file(folder: Path, posterior: Posterior, small_record: Record) -> None:
    tree = xarray.open_datatree(folder / "posterior.nc", engine="h5netcdf")
    draws = tree["posterior"]["gain"]
    assert draws.dims == ("chain", "draw") and draws.shape == (ENSEMBLES * WALKERS, STEPS)
    assert tree["posterior"]["mode1.frequency_hz"].attrs["unit"] == "Hz"
    third = draws.values[tree["posterior"]["ensemble"].values == 2]
    np.testing.assert_array_equal(third.T, posterior.chains("gain")[2])
    np.testing.assert_array_equal(tree["observed_data"]["y1"].values, small_record.y)
    np.testing.assert_array_equal(tree["constant_data"]["u1"].values, small_record.u)
    prior = tree["prior"]["gain"].values
    assert np.median(prior) == pytest.approx(0.02, rel=0.01)
    effective = array_stats.ess(draws.values, method="mean")
    assert float(effective) == pytest.approx(posterior.chains("gain").size, rel=0.2)


def test_many_draws_are_thinned_in_the_file_alone(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    long = posterior_of(small_axis, steps=STORED_DRAWS // (ENSEMBLES * WALKERS) + 5)
    long.write(tmp_path)
    found = Posterior.read(tmp_path)
    np.testing.assert_array_equal(found.values, long.values[:, ::2])
    assert json.loads((tmp_path / "posterior.json").read_text())["steps"] == long.values.shape[1]


def test_velocity_gain_is_that_of_each_model(posterior: Posterior) -> None:
    model = posterior.axis.model
    flat = posterior.values.reshape(-1, posterior.values.shape[-1])[:200]
    found = posterior.axis.velocity_gain(flat[:, : len(posterior.axis.parameters)].T)
    for values, gain in zip(flat, found, strict=True):
        linear = posterior.axis.to_model(values[: len(posterior.axis.parameters)]).linear
        assert gain == pytest.approx(linear.velocity_gain(model.sample_rate_hz), rel=1e-11)
    derived = posterior.derived["velocity_gain"]
    assert derived.unit == "(deg/s)/(deg/s)"
    assert derived.mean == pytest.approx(model.linear.velocity_gain(20.0), rel=0.02)


def test_derived_noise(posterior: Posterior) -> None:
    derived = posterior.derived
    partial = np.stack([posterior.chains(f"noise.partial_autocorrelation{i}").ravel() for i in (1, 2)])
    phi = autoregression_from_partial(partial)
    assert derived["noise.autoregression1"].mean == pytest.approx(phi[0].mean())
    assert derived["noise.autoregression2"].mean == pytest.approx(phi[1].mean())
    innovation = posterior.chains("noise.sigma").ravel() * np.sqrt(np.prod(1 - partial**2, axis=0))
    assert derived["noise.innovation_sigma"].mean == pytest.approx(innovation.mean())


def test_no_velocity_gain_without_an_integrator(small_axis: HammersteinWiener) -> None:
    poles = small_axis.linear.poles.copy()
    poles[0] = 0.9
    linear = LinearBlock(small_axis.linear.zeros, poles, 0.02, 1)
    assert "velocity_gain" not in posterior_of(replace(small_axis, linear=linear)).derived


def test_draws_and_mean_model(posterior: Posterior) -> None:
    rng = np.random.default_rng(3)
    draws = posterior.draws(50, rng)
    flat = posterior.values.reshape(-1, posterior.values.shape[-1])
    assert draws.shape == (50, flat.shape[1]) and len(np.unique(draws[:, 0])) == 50
    assert np.isin(draws[:, 0], flat[:, 0]).all()
    assert len(posterior.draws(10**6, rng)) == len(flat)
    model = posterior.mean_model()
    assert model.saturation.upper == pytest.approx(posterior.chains("saturation.upper").mean())
    assert model.noise_sigma == pytest.approx(posterior.chains("noise.sigma").mean())


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"posterior\.nc: missing"):
        Posterior.read(tmp_path)


@pytest.mark.parametrize(
    "damage",
    ["empty", "text", "truncated", "foreign HDF5", "no draws", "draws of another shape", "state", "names"],
)
def test_damaged_file(folder: Path, tmp_path: Path, damage: str) -> None:
    """Every way of being wrong is one line that names the file."""
    path = tmp_path / "posterior.nc"
    path.write_bytes((folder / "posterior.nc").read_bytes())
    if damage == "empty":
        path.write_bytes(b"")
    elif damage == "text":
        path.write_text("gain,sigma\n1,2\n")
    elif damage == "truncated":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    elif damage == "foreign HDF5":
        with h5py.File(path, "w") as file:
            file["x"] = np.zeros(3)
    else:
        with h5py.File(path, "a") as file:
            state = json.loads(file.attrs["bayes_hw"])
            if damage == "no draws":
                del file["posterior"]["gain"]
            elif damage == "draws of another shape":
                del file["posterior"]["gain"]
                file["posterior"]["gain"] = np.zeros(7)
            elif damage == "state":
                file.attrs["bayes_hw"] = "{"
            else:
                state["noise_partial"] = [0.1]
                file.attrs["bayes_hw"] = json.dumps(state)
    with pytest.raises(InputError, match=r"posterior\.nc: ") as caught:
        Posterior.read(tmp_path)
    assert "\n" not in str(caught.value)


def test_contraction_tells_data_from_prior(small_axis: HammersteinWiener) -> None:
    """Draws from the priors themselves are prior-dominated; draws a hundred times as narrow are not."""
    informed = posterior_of(small_axis)
    assert informed.prior_dominated == ()
    assert min(informed.contraction.values()) > 0.9
    levels = np.random.default_rng(2).uniform(size=informed.values.shape)
    from_priors = np.stack(
        [p.prior.quantile(levels[..., i]) for i, p in enumerate(informed.parameters)], axis=-1
    )
    ignorant = replace(informed, values=from_priors)
    assert ignorant.prior_dominated == ignorant.names


def test_a_limit_that_no_command_reaches_is_said_wherever_the_posterior_goes(
    small_axis: HammersteinWiener, tmp_path: Path
) -> None:
    """Met below and not above; of a posterior whose commands nobody said nothing is known."""
    plain = posterior_of(small_axis)
    upper = float(np.median(plain.chains("saturation.upper")))
    lower = float(np.median(plain.chains("saturation.lower")))
    posterior = replace(plain, commanded=(1.5 * lower, 0.9 * upper))
    posterior.write(tmp_path)
    for one in (posterior, Posterior.read(tmp_path)):
        assert one.unreached == ("saturation.upper",)
    assert json.loads((tmp_path / "posterior.json").read_text())["unreached"] == ["saturation.upper"]
    assert plain.unreached == ()
