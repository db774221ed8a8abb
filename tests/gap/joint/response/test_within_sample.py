"""Several steps a sample: the same linear response, right derivatives, laws that act between samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import (
    CASCADE,
    STRUCTURE,
    assert_tangents,
    command,
    form,
    record,
    response_with,
    scale,
    some_effect,
    torque,
)

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.response.kernel_numbers import Paths
from bayes_hw.gap.joint.response.within_sample import LEAST_POLE, Stepped, root_of
from bayes_hw.identify.cascade import CascadeValues

SAMPLES = 200
REAL = CascadeValues(
    -0.35, 0.3, 0.02, 0.0, 0.005, np.array([[0.8, 0.3], [2e-3, -1e-3]]),
    np.array([[1.5, 1.2], [0.9, 0.35], [1e-3, 5e-4], [-8e-4, 4e-4]]), np.zeros((1, 3)),
)  # fmt: skip


def _with_reals(effects: tuple[Effect, ...], steps: int) -> tuple[JointResponse, JointValues]:
    """Two real poles, a resonance and a section of two real poles."""
    structure = replace(STRUCTURE, real_poles=2, sections=2)
    records = [record(np.zeros(SAMPLES), 1)]
    return JointResponse(structure, effects, records, scale(SAMPLES), steps=steps), JointValues(REAL, effects)


def test_a_held_command_meets_the_same_axis() -> None:
    u = command(SAMPLES, 1)
    once, values = _with_reals((), 1)
    for steps in (2, 5):
        often, _ = _with_reals((), steps)
        np.testing.assert_allclose(often.simulate(values, u).y, once.simulate(values, u).y, atol=1e-9)


@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_tangents_are_the_derivatives(law: Form) -> None:
    effect = some_effect(law)
    response, values = response_with((effect,), SAMPLES)
    response = replace(response, steps=3)
    assert_tangents(response, values, law.full_name)


def test_one_step_a_sample_changes_no_pole_that_has_no_root() -> None:
    weights = (
        np.ones((1, 1)),
        np.ones((1, 2, 1)),
        np.array([[0.2, -0.5]]),
        np.ones((1, 1)),
        np.ones((1, 2, 1)),
    )
    sections = np.array([[-0.2], [-0.3], [1.0], [1.0]])
    paths = Paths(0.005, np.array([[-0.4], [1.0]]), sections, *weights)
    assert Stepped(paths, 1).fast is paths


def test_tangents_by_real_poles_and_their_ports() -> None:
    law = form("friction", "Coulomb, load")
    effect = torque(law, (0.0015,), 2e-3)
    assert effect.ports is not None
    ports = replace(
        effect.ports, real=np.array([1e-3, 5e-4]), sections=np.array([[1e-3, 2e-4], [-5e-4, 1e-4]]),
        signal_real=np.array([0.1, 0.2]), signal_sections=np.array([[0.1, 0.05], [0.02, 0.1]]),
    )  # fmt: skip
    response, values = _with_reals((replace(effect, ports=ports),), 4)
    assert_tangents(response, values, law.full_name)


def test_steps_converge_on_an_axis_that_sticks_within_a_sample() -> None:
    """Friction that stops the load between two samples: sixteen steps and thirty-two agree far better than
    one and two."""
    friction = torque(form("friction", "Coulomb, load"), (0.0005,), 2e-3, 0.0)
    response, values = response_with((friction,), SAMPLES)
    u = command(SAMPLES, 1)
    runs = {n: replace(response, steps=n).simulate(values, u).y for n in (1, 2, 16, 32)}
    fine = np.abs(runs[32] - runs[16]).max()
    assert fine < 0.2 * np.abs(runs[2] - runs[1]).max()


def test_limits_that_look_at_the_middle_of_a_sample_are_those_that_move_within_it() -> None:
    """Of a period that is crossed in some ten samples; looked at where the sample begins they are not."""
    u = 2 * command(SAMPLES, 1)

    def run(lead: float, steps: int) -> FloatArray:
        waves = Effect(form("saturation_drift"), np.array([0.2, 0.1, 60.0, lead]))
        response, values = response_with((waves,), SAMPLES)
        return replace(response, steps=steps).simulate(values, u).y

    moving = run(0.0, 64)
    errors = {lead: np.abs(run(lead, 1) - moving).max() for lead in (0.0, 0.5)}
    assert errors[0.5] < 0.1 * errors[0.0]


def test_roots_go_on_smoothly_where_there_are_none() -> None:
    poles = np.array([-0.4, 0.0, LEAST_POLE - 1e-9, LEAST_POLE + 1e-9, 0.5], dtype=np.complex128)
    roots = root_of(poles, 4)
    assert np.all(np.diff(roots.real) > 0)
    assert roots[2].real == pytest.approx(roots[3].real, abs=1e-7)
    assert root_of(np.array([0.8 * np.exp(1j)]), 4)[0] ** 4 == pytest.approx(0.8 * np.exp(1j))


@pytest.mark.parametrize("steps", [1, 4])
def test_a_load_that_friction_holds_stands_still(steps: int) -> None:
    """A torque larger than what drives the load: no step moves it, and the torque is just what it takes."""
    law = form("friction", "Coulomb, load")
    structure = replace(STRUCTURE, integrator=False)
    cascade = replace(CASCADE, integrator_residue=0.0, starts=np.zeros((1, 2)))
    effect = torque(law, (1e-9,), 2e-2, 0.0)
    response = JointResponse(
        structure, (effect,), [record(np.zeros(SAMPLES), 1)], scale(SAMPLES), steps=steps
    )
    run = response.simulate(JointValues(cascade, (effect,)), command(SAMPLES, 1))
    assert np.abs(run.w).max() < 1e-6
    assert 0.01 < np.abs(run.torques).max() < 1.0
