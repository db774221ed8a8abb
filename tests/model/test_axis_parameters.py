"""A parameter vector becomes the model that its names say, with the free response that it describes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from simulated_records import command

from bayes_hw.model.axis_parameters import AxisParameters, FreeSet
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.model.parameters import as_coordinates, as_values


def scattered(axis: AxisParameters, walkers: int, spread: float = 0.05) -> np.ndarray:
    """Values (parameters, walkers) about the nominal ones."""
    centre = as_coordinates(axis.parameters, axis.nominal[:, None])
    noise = np.random.default_rng(1).standard_normal((len(centre), walkers))
    return as_values(axis.parameters, centre + spread * noise)


@pytest.mark.parametrize("zeros", [[], [0.3], [0.3, -0.2], [0.3, 0.2, 0.1]])
def test_the_gain_is_that_of_the_model_whatever_its_zeros(zeros: list[float]) -> None:
    """At the nominal values, and where the gain alone is another."""
    pole = Mode(2.0, 0.1).pole(20.0)
    poles = np.array([1.0, pole, np.conj(pole)], dtype=complex)
    linear = LinearBlock(np.array(zeros, dtype=complex), poles, 0.02, 1)
    axis = AxisParameters(replace(nanshan_model(), linear=linear, dominant_modes=(Mode(2.0, 0.1),)), "all")
    assert axis.gain(axis.nominal[:, None]) == pytest.approx([0.02])
    weights = [row for row, name in enumerate(axis.names) if name in ("velocity_gain", "direct")]
    weights += [row for row, name in enumerate(axis.names) if name.endswith((".cosine", ".sine", ".weight"))]
    values = axis.nominal[:, None].copy()
    values[weights] *= 1.5
    assert axis.gain(values) == pytest.approx([0.03])


@pytest.mark.parametrize("free", ["conditional", "all"])
def test_nominal_values_give_the_nominal_model_back(free: FreeSet) -> None:
    model = nanshan_model()
    axis = AxisParameters(model, free)
    found = axis.to_model(axis.nominal)
    np.testing.assert_allclose(
        np.sort_complex(found.linear.poles), np.sort_complex(model.linear.poles), atol=1e-12
    )
    np.testing.assert_allclose(
        np.sort_complex(found.linear.zeros), np.sort_complex(model.linear.zeros), atol=1e-12
    )
    assert found.linear.gain == pytest.approx(model.linear.gain)
    assert (found.saturation, found.dead_zone) == (model.saturation, model.dead_zone)
    assert found.linear.delay_samples == model.linear.delay_samples
    for one, other in zip(found.dominant_modes, model.dominant_modes, strict=True):
        assert one.frequency_hz == pytest.approx(other.frequency_hz)
        assert one.damping_ratio == pytest.approx(other.damping_ratio)


def test_dominant_set_names_what_the_formats_promise() -> None:
    axis = AxisParameters(nanshan_model())
    assert axis.names == (
        *("saturation.lower", "saturation.upper", "dead_zone.half_width", "gain"),
        *("mode1.frequency_hz", "mode1.damping_ratio", "mode2.frequency_hz", "mode2.damping_ratio"),
    )
    assert axis.nominal[4] < axis.nominal[6]


def test_all_frees_every_root_but_the_integrator() -> None:
    """Limits and half width; every pole but the integrator; a residue for every pole."""
    model = nanshan_model()
    axis = AxisParameters(model, "all")
    assert len(axis.names) == len(set(axis.names))
    assert len(axis.names) == 3 + (len(model.linear.poles) - 1) + len(model.linear.poles)
    values = scattered(axis, 20)
    for column in values.T:
        linear = axis.to_model(column).linear
        assert linear.integrator_index is not None
        assert linear.poles[linear.integrator_index] == 1.0


@pytest.mark.parametrize("free", ["conditional", "all"])
def test_modal_form_simulates_the_model_of_each_column(free: FreeSet) -> None:
    """The kernel's parallel form against second-order sections of the same parameter vector."""
    axis = AxisParameters(nanshan_model(), free)
    values = scattered(axis, 5, 0.02)
    u = command(200, np.random.default_rng(2))
    batch = simulate_batch(axis.modal_form(values), u, axis.model.linear.delay_samples)
    for column, w in zip(values.T, batch.w, strict=True):
        model = axis.to_model(column)
        expected = model.linear.filter(model.saturation(u))
        np.testing.assert_allclose(w, expected, atol=1e-8 * np.abs(expected).max())


def test_order_of_modes() -> None:
    axis = AxisParameters(nanshan_model())
    values = np.repeat(axis.nominal[:, None], 3, axis=1)
    values[4, 1] = values[6, 1] + 0.1
    values[4, 2] = values[6, 2]
    assert axis.in_order(values).tolist() == [True, False, False]


def test_a_single_mode_is_always_in_order(small_axis: HammersteinWiener) -> None:
    axis = AxisParameters(small_axis)
    assert axis.in_order(scattered(axis, 4)).all()


def test_a_dead_zone_of_zero_still_has_a_prior(small_axis: HammersteinWiener) -> None:
    axis = AxisParameters(
        replace(small_axis, dead_zone=replace(small_axis.dead_zone, half_width=0.0)), output_scale=4.0
    )
    parameter = axis.parameters[2]
    assert parameter.nominal > 0
    assert float(parameter.prior.quantile(np.array(0.6827))) == pytest.approx(0.05 * 4.0, rel=1e-3)


def slow_axis(integrator: bool) -> HammersteinWiener:
    """A real pole at 0.9, one at 0.2 that is soon forgotten, a mode, and perhaps an integrator."""
    mode = Mode(2.0, 0.1)
    pole = mode.pole(20.0)
    poles = np.array([0.9, *([1.0] if integrator else []), 0.2, pole, pole.conjugate()])
    linear = LinearBlock(np.array([0.3 + 0j]), poles, 0.02, 2)
    return replace(nanshan_model(0.0), linear=linear, dominant_modes=(mode,))


@pytest.mark.parametrize("integrator", [True, False])
def test_free_response_is_the_one_described(integrator: bool) -> None:
    """position + a 0.9^k + Re((A - iB) p^k), per record, with u = 0; a fast pole has no initial state.

    The position is that of y: w stands half a dead zone beyond it."""
    model = slow_axis(integrator)
    axis = AxisParameters(model, start_positions=np.array([0.5, -1.0]), output_scale=1.0)
    values = axis.nominal[:, None].copy()
    values[axis.names.index("dead_zone.half_width")] = 0.25
    described = {"real_pole2": 0.7, "pair1.cosine": 0.2, "pair1.sine": -0.4}
    if integrator:
        described["position"] = 1.3
    expected_names = {f"start{record}.{name}" for record in (1, 2) for name in described}
    assert {name for name in axis.names if name.startswith("start")} == expected_names
    k = np.arange(60)
    pole = model.dominant_modes[0].pole(20.0)
    for record in (1, 2):
        for name, value in described.items():
            values[axis.names.index(f"start{record}.{name}"), 0] = record * value
        found = simulate_batch(axis.modal_form(values, record - 1), np.zeros(60), 2).w[0]
        beyond = np.sign(axis.start_positions[record - 1]) * 0.25 if integrator else 0.0
        expected = 0.7 * 0.9**k + ((0.2 + 0.4j) * pole**k).real + (1.3 if integrator else 0)
        np.testing.assert_allclose(found, record * expected + beyond, atol=1e-12)


def test_velocity_gain_needs_an_integrator() -> None:
    with_integrator, without = (AxisParameters(slow_axis(flag)) for flag in (True, False))
    values = with_integrator.nominal[:, None]
    expected = with_integrator.model.linear.velocity_gain(20.0)
    assert with_integrator.velocity_gain(values)[0] == pytest.approx(expected, rel=1e-12)
    assert np.isnan(without.velocity_gain(without.nominal[:, None])).all()


def test_frequency_response_is_that_of_each_model() -> None:
    axis = AxisParameters(nanshan_model())
    values = scattered(axis, 3)
    frequencies = np.array([0.5, 3.3, 9.0])
    found = axis.frequency_response(values, frequencies)
    for column, response in zip(values.T, found, strict=True):
        np.testing.assert_allclose(
            response, axis.to_model(column).linear.frequency_response(frequencies, 20.0), rtol=1e-9
        )


@pytest.mark.parametrize("free", ["conditional", "all"])
def test_renumbering_poles_changes_their_names_and_nothing_else(free: FreeSet) -> None:
    """Modes and real poles put in order give the same response; vectors in order are left alone."""
    low, high = Mode(2.0, 0.05), Mode(3.5, 0.1)
    pairs = [mode.pole(20.0) for mode in (low, high)]
    poles = np.array([1.0, 0.9, 0.2, *pairs, *np.conj(pairs)])
    linear = LinearBlock(np.array([0.3 + 0j]), poles, 0.02, 2)
    axis = AxisParameters(replace(nanshan_model(0.0), linear=linear, dominant_modes=(low, high)), free)
    values = axis.nominal.copy()
    np.testing.assert_array_equal(axis.put_in_order(values), values)
    swapped = values.copy()
    for name in axis.names:
        if name.startswith("mode1."):
            first, second = axis.names.index(name), axis.names.index(name.replace("mode1", "mode2"))
            swapped[[first, second]] = values[[second, first]]
    if free == "all":
        swapped[axis.names.index("real_pole1.value")] = 0.95
    restored = axis.put_in_order(swapped)
    assert not axis.in_order(swapped[:, None])[0] and axis.in_order(restored[:, None])[0]
    frequency = np.linspace(0.1, 9.0, 40)
    np.testing.assert_allclose(
        axis.frequency_response(restored[:, None], frequency),
        axis.frequency_response(swapped[:, None], frequency),
        rtol=1e-9,
    )


def test_a_pole_of_no_weight_has_no_free_response() -> None:
    """Its initial state is not a number otherwise, and nor is any output."""
    linear = LinearBlock(np.array([0.9 + 0j]), np.array([1.0, 0.9], complex), 0.1, 0)
    model = HammersteinWiener("axis", 20.0, Saturation(-1.0, 1.0), linear, DeadZone(0.0), ())
    axis = AxisParameters(model, start_positions=np.array([0.5]), output_scale=1.0)
    form = axis.modal_form(axis.nominal[:, None], 0)
    assert np.isfinite(form.real_state).all()
