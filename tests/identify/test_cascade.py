"""The modal cascade is the Hammerstein-Wiener model in other coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_axis import commands, known_axis, simulated_records

from bayes_hw.identify.cascade import CascadeValues, Structure, simulate, to_coordinates, to_values
from bayes_hw.identify.cascade_basis import linear_basis, with_linear_solution
from bayes_hw.identify.cascade_fit import evaluated, solve_linear_part
from bayes_hw.identify.cascade_roots import linear_block, poles_of, with_poles
from bayes_hw.identify.resonances import dominant_modes

AXIS = known_axis()
RNG = np.random.default_rng(1)
RECORDS = simulated_records(AXIS, commands(RNG, 2, 0.3, 20.0), RNG)
STRUCTURE = replace(
    Structure.of_order(6, AXIS.linear.total_delay - 1, True), lower=True, upper=True, dead_zone=True
)


def solved_cascade() -> tuple[Structure, np.ndarray]:
    """The cascade equal to AXIS, by solving for the residues on its own intermediate signal."""
    poles = with_poles(STRUCTURE, AXIS.linear.poles[1:])
    simulations = [AXIS.simulate(record.u) for record in RECORDS]
    masks = [np.ones(len(record)) for record in RECORDS]
    values, error = solve_linear_part(
        STRUCTURE, poles, [s.v for s in simulations], [s.w for s in simulations], masks, differenced=False
    )
    assert error < 1e-12
    values = replace(values, lower=-0.3, upper=0.42, half_width=0.05)
    return STRUCTURE, to_coordinates(STRUCTURE, values)


def test_the_cascade_simulates_the_model() -> None:
    structure, coordinates = solved_cascade()
    for record, output in zip(RECORDS, simulate(structure, coordinates[:, None], RECORDS), strict=True):
        np.testing.assert_allclose(output[0], record.y, atol=1e-11)


def test_the_linear_block_comes_back() -> None:
    structure, coordinates = solved_cascade()
    block = linear_block(structure, to_values(structure, coordinates, len(RECORDS)))
    frequency = np.linspace(0.05, 9.5, 40)
    np.testing.assert_allclose(
        block.frequency_response(frequency, 20.0), AXIS.linear.frequency_response(frequency, 20.0), rtol=1e-8
    )


def test_both_modes_are_dominant_and_a_cancelled_one_is_not() -> None:
    structure, coordinates = solved_cascade()
    values = to_values(structure, coordinates, len(RECORDS))
    found = dominant_modes(structure, values, 20.0, 20.0)
    assert [mode.frequency_hz for mode in found] == pytest.approx([1.8, 3.7])
    sections = values.sections.copy()
    sections[2:, 0] *= 1e-3
    assert len(dominant_modes(structure, replace(values, sections=sections), 20.0, 20.0)) == 1
    alternating = values.sections.copy()
    alternating[:2, 1] = 2 * 0.99 * np.cos(0.97 * np.pi), 0.99**2
    assert len(dominant_modes(structure, replace(values, sections=alternating), 20.0, 20.0)) == 1


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-6, 6), min_size=12, max_size=12))
def test_every_coordinate_vector_is_stable(tangents: list[float]) -> None:
    structure = Structure(1, True, 2, 2)
    coordinates = np.concatenate([[1.0], tangents[:2], [1, 1], tangents[2:6], np.ones(4)])
    poles = poles_of(to_values(structure, coordinates, 1), integrator=False)
    assert np.all(np.abs(poles) <= 1 + 1e-9)


def test_coordinates_round_trip_through_values() -> None:
    structure = replace(STRUCTURE, input_offset=True, free_start=True)
    coordinates = 0.3 * np.random.default_rng(2).standard_normal(structure.size(2))
    again = to_coordinates(structure, to_values(structure, coordinates, 2))
    np.testing.assert_allclose(again, coordinates, rtol=1e-9, atol=1e-12)


def test_free_responses_are_solved_for() -> None:
    structure = replace(Structure.of_order(6, 2, True), free_start=True)
    poles = with_poles(structure, AXIS.linear.poles[1:])
    u = [record.u for record in RECORDS]
    basis = linear_basis(structure, poles, u)
    weights = np.random.default_rng(3).standard_normal(len(basis[0]))
    values = with_linear_solution(structure, poles, weights)
    fit = evaluated(structure, values, RECORDS)
    for block, residual, record in zip(basis, fit.residuals, RECORDS, strict=True):
        np.testing.assert_allclose(record.y - residual, weights @ block, atol=1e-9)


@pytest.mark.parametrize(("a1", "a2"), [(0.0, -1.0), (2.0, 1.0), (1.9, 0.999999999999), (1.0, 0.5)])
def test_a_section_at_the_corner_of_stability_is_a_stable_block(a1: float, a2: float) -> None:
    """Poles at 1 and -1 beside the integrator; what a section answers changes by no more than rounding."""
    structure = Structure(0, True, 1, 1)
    values = CascadeValues(
        -1.0,
        1.0,
        0.0,
        0.0,
        0.5,
        np.array([[1.0], [1e-9]]),
        np.array([[a1], [a2], [1e-3], [2e-3]]),
        np.zeros((0, structure.order)),
    )
    block = linear_block(structure, values)
    block.check_stable()
    f = np.linspace(0.03, 0.4, 20)
    z = np.exp(2j * np.pi * f)
    truth = 0.5 / (z - 1) + 1e-9 / (z - 1) + (1e-3 * z + 2e-3) / (z * z - a1 * z + a2)
    np.testing.assert_allclose(block.frequency_response(f, 1.0), truth, rtol=1e-6)
