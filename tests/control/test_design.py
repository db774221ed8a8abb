"""The whole design of a small axis, and its files read back."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from scipy.io import loadmat
from spread_axis import spread_posterior

from bayes_hw.control.controller import Controller
from bayes_hw.control.design import Design, DesignSettings, design
from bayes_hw.control.export import SCHEMA, write_design
from bayes_hw.control.margins import Requirements, loop_margins
from bayes_hw.control.python_control import (
    axis_systems,
    controller_system,
    nominal_system,
    posterior_systems,
    weight_system,
)
from bayes_hw.errors import InputError
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SETTINGS = DesignSettings(
    draws=300, search_draws=60, simulated_draws=40, requirements=Requirements(6.0, 45.0, 0.05)
)
PI = Controller("given", 20.0, 1.0, 0.2, low_pass_hz=3.0)


@pytest.fixture(scope="module")
def found(posterior: Posterior) -> Design:
    slow = replace(PI, name="slow", sample_rate_hz=10.0)
    return design(posterior, [PI, slow], np.random.default_rng(1), settings=SETTINGS)


@pytest.fixture(scope="module")
def folder(found: Design, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("design")
    write_design(folder, found)
    return folder


@pytest.fixture(scope="module")
def content(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "design.json").read_text())
    return read


def test_quantities_are_those_of_the_posterior(found: Design, posterior: Posterior) -> None:
    """Intervals of parameters agree with the posterior's own within the noise of 300 draws."""
    for name in ("saturation.lower", "dead_zone.half_width", "mode1.frequency_hz", "mode1.damping_ratio"):
        quantity, summary = found.plant.quantities[name], posterior.summaries[name]
        assert quantity.mean == pytest.approx(summary.mean, abs=0.3 * summary.sd)
        assert quantity.unit == summary.unit
        assert quantity.hdi94 == pytest.approx(summary.hdi94, abs=0.8 * summary.sd)
    model = posterior.axis.model
    gain = model.linear.velocity_gain(model.sample_rate_hz)
    assert found.plant.quantities["velocity_gain"].nominal == pytest.approx(gain)
    assert found.plant.quantities["speed.upper"].nominal == pytest.approx(gain * model.saturation.upper)
    assert found.plant.transport_delay_samples == model.linear.total_delay


def test_bands_hold_ninety_four_per_cent_at_every_frequency(found: Design) -> None:
    response = 20 * np.log10(np.abs(found.axis.response(found.plant.frequency_hz)))
    low, high = found.plant.magnitude_db
    inside = np.mean((response >= low) & (response <= high), axis=0)
    np.testing.assert_allclose(inside, 0.94, atol=0.01)


def test_loops_are_the_given_and_the_tuned_ones(found: Design) -> None:
    names = [loop.controller.name for loop in found.loops]
    assert names == ["given", "slow", "PI tuned over the posterior", "PI tuned on the point estimate"]
    assert [len(loop.robustness_peaks) for loop in found.loops] == [3, 0, 3, 3]
    assert found.tunings[0].robust.controller.low_pass_hz == 3.0


def test_too_few_draws_are_refused(small_axis: HammersteinWiener) -> None:
    posterior = spread_posterior(small_axis)
    short = replace(
        posterior, values=posterior.values[:, :1], log_probability=posterior.log_probability[:, :1]
    )
    with pytest.raises(InputError, match="sample longer"):
        design(short, [PI], np.random.default_rng(1), settings=SETTINGS)


def test_json_states_probabilities_and_units(content: dict[str, Any], found: Design) -> None:
    assert content["schema"] == SCHEMA
    assert content["units"]["input"] == "deg/s"
    assert content["requirements"] == {
        "gain_margin_db": 6.0,
        "phase_margin_deg": 45.0,
        "delay_margin_s": 0.05,
    }
    given = content["loops"][0]
    margins = found.loops[0].margins
    assert given["probability_stable"] == np.mean(margins.stable)
    assert given["probability_margins_met"] == np.mean(margins.meets(SETTINGS.requirements))
    entry = given["margins"]["gain_margin_db"]
    assert entry["unit"] == "dB"
    assert entry["q5"] == pytest.approx(np.quantile(margins.gain_margin_db, 0.05), rel=0.01)
    for quantity in content["axis"]["quantities"].values():
        assert set(quantity) == {"unit", "nominal", "mean", "sd", "hdi94"}
    assert {place["place"] for place in given["limit_cycles"]} == {"away from zero", "around zero"}
    assert given["responses"]["step"]["overshoot"]["unit"] == "%"
    assert given["responses"]["sidereal"]["rms error"]["unit"] == "deg"


def test_json_draws_make_the_same_margins(
    content: dict[str, Any], found: Design, posterior: Posterior
) -> None:
    """The draws in the file are enough to compute the margins again."""
    from bayes_hw.control.axis_draws import AxisDraws
    from bayes_hw.control.loop import Loop

    values = np.array(content["draws"]["values"])
    assert values.shape == (300, len(content["draws"]["parameters"]))
    margins = loop_margins(Loop(AxisDraws.of_posterior(posterior, values), PI))
    np.testing.assert_array_equal(margins.gain_margin_db, found.loops[0].margins.gain_margin_db)
    assert HammersteinWiener.from_dict(content["nominal"]).linear.gain == pytest.approx(0.02)


def test_json_weights_are_systems_again(content: dict[str, Any], found: Design) -> None:
    stated = content["uncertainty"][0]["weights"][2]
    system = control.tf(stated["numerator"], stated["denominator"], 0.05)
    weight = found.sets[0].weights[2]
    frequency = np.array([0.1, 1.0, 5.0])
    size = np.abs(system(np.exp(2j * np.pi * frequency / 20)))
    np.testing.assert_allclose(size, weight.magnitude(frequency), rtol=1e-9)
    assert stated["achieved_share_fresh_draws"] == found.sets[0].achieved[2]


def test_tuned_controller_is_a_controller_file(folder: Path, found: Design) -> None:
    assert Controller.read(folder / "controller_pi_tuned.json") == found.tunings[0].robust.controller


def test_matlab_file_reads_back(folder: Path, found: Design) -> None:
    """Nominal, draws, weights and controllers; G from each of its forms is the same."""
    read = loadmat(folder / "design.mat", squeeze_me=True, struct_as_record=False)
    nominal, draws = read["nominal"], read["draws"]
    frequency = nominal.frequency_hz
    z = np.exp(2j * np.pi * frequency * nominal.sample_time)
    poles, residues = nominal.poles.reshape(-1), nominal.residues.reshape(-1)
    modal = (nominal.direct + (residues / (z[:, None] - poles)).sum(axis=1)) * z ** -float(
        nominal.delay_samples
    )
    np.testing.assert_allclose(modal, nominal.response, rtol=1e-9)
    ratio = np.polyval(nominal.numerator[::-1], 1 / z) / np.polyval(nominal.denominator[::-1], 1 / z)
    np.testing.assert_allclose(ratio, nominal.response, rtol=1e-7)
    np.testing.assert_array_equal(draws.response, found.axis.response(found.plant.frequency_hz))
    np.testing.assert_array_equal(draws.saturation_upper, found.axis.upper)
    speed = draws.quantities.speed_upper
    np.testing.assert_array_equal(speed.draws, found.plant.draws["speed.upper"])
    assert speed.unit == "deg/s"
    weight = read["weights"].additive.order2
    np.testing.assert_allclose(weight.numerator, found.sets[1].weights[1].transfer_function()[0])
    assert read["weights"].additive.share == 0.95
    first = read["controllers"][0]
    assert (first.name, first.proportional, first.units.proportional) == ("given", 1.0, "(deg/s)/deg")
    assert nominal.units.output == "deg"
    assert found.sets[1].kind == "additive"


def test_objects_of_python_control(found: Design, posterior: Posterior) -> None:
    """Frequency responses of nominal system, draws, controller and weight, and a stable closed loop."""
    frequency = np.array([0.1, 1.0, 1.9, 4.0])
    z = np.exp(2j * np.pi * frequency / 20)
    linear = posterior.axis.model.linear
    np.testing.assert_allclose(
        nominal_system(posterior)(z), linear.frequency_response(frequency, 20.0), rtol=1e-9
    )
    for system, response in zip(axis_systems(found.axis)[:5], found.axis.response(frequency), strict=False):
        assert isinstance(system, control.StateSpace)
        np.testing.assert_allclose(system(z), response, rtol=1e-9)
    assert len(posterior_systems(posterior, 7, np.random.default_rng(1))) == 7
    compensator = controller_system(PI)
    np.testing.assert_allclose(compensator(z), PI.response(frequency), rtol=1e-9)
    closed = control.feedback(axis_systems(found.axis)[0] * compensator)
    assert np.abs(closed.poles()).max() == pytest.approx(found.loops[0].margins.radius[0], rel=1e-9)
    assert weight_system(found.sets[0].weights[0]).dt == 0.05
