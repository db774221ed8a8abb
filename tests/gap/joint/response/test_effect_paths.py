"""How a torque enters is linear in the weights of its port."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, form, response_with, torque

from bayes_hw.gap.joint.response.effect_paths import port_columns, through_port
from bayes_hw.gap.joint.response.joint_values import DIRECT_POLE, JointValues

SAMPLES = 300


def test_the_columns_of_a_port_make_up_what_enters_through_it() -> None:
    entering = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    ports = entering.ports
    assert ports is not None
    ports.direct[1] = DIRECT_POLE
    values = JointValues(CASCADE, (entering,))
    torques = np.random.default_rng(1).standard_normal((2, SAMPLES))
    weights = np.concatenate([ports.real, ports.sections.T.ravel(), ports.direct[:1]])
    columns = port_columns(values, torques)
    assert columns.shape == (2, STRUCTURE.real_poles + 2 * STRUCTURE.sections + 1, SAMPLES)
    np.testing.assert_allclose(
        np.einsum("w,nws->ns", weights, columns), through_port(values, entering, torques), atol=1e-14
    )


def test_a_law_beside_the_effects_changes_nothing_and_has_its_torque() -> None:
    acting = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    response, values = response_with((acting,), SAMPLES)
    idle = torque(form("torque_ripple"), (40.0, 0.7), 0.0)
    (run,) = response.beside(values, [idle, idle])
    alone = response.along(values, 0)
    np.testing.assert_array_equal(run.y, alone.y)
    np.testing.assert_allclose(
        run.torques[-1], np.sin(40.0 * run.signals[-1] + 0.7) - np.sin(0.7), atol=1e-12
    )
    assert run.torques[0] == pytest.approx(alone.torques[0])
