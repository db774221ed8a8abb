"""Moves between explanations begin where they should."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, form, measured, scale, torque

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.other_cascades import smaller_cascades
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 1200
NEXT_TO_ONE = 0.9999999

# Sums in another order let a friction that sticks slip a sample sooner: a few hundredths of a nat.


def fit_at(structure: Structure, cascade: CascadeValues, effects: tuple[Effect, ...]) -> JointFit:
    """At these values, not descended; the records are those of the axis with friction."""
    records = measured((friction(),), SAMPLES, (1, 2))
    response = JointResponse(structure, effects, records, scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(cascade, effects))))


def friction() -> Effect:
    return torque(form("friction", "Coulomb, load"), (1e-4,), 2e-4)


@pytest.mark.parametrize("with_friction", [False, True])
def test_a_pole_beside_the_integrator_hands_its_weight_over(with_friction: bool) -> None:
    """The response stays; with the weight left out it is another axis."""
    effects = (friction(),) if with_friction else ()
    smaller = fit_at(STRUCTURE, CASCADE, effects)
    split = replace(
        CASCADE,
        integrator_residue=CASCADE.integrator_residue - 0.03,
        real=np.array([[NEXT_TO_ONE], [0.03]]),
        starts=np.zeros((1, 4)),
    )
    larger = fit_at(
        replace(STRUCTURE, real_poles=1),
        split,
        tuple(replace(e, ports=with_pole(e.ports)) for e in effects if e.ports is not None),
    )
    *_, found = smaller_cascades(larger)
    assert found.structure == smaller.structure
    assert abs(found.log_likelihood - smaller.log_likelihood) < 1
    left_out = fit_at(STRUCTURE, replace(CASCADE, integrator_residue=-0.025), effects)
    assert left_out.log_likelihood < smaller.log_likelihood - 1000


def with_pole(ports: Ports) -> Ports:
    return replace(ports, real=np.zeros(1), signal_real=np.zeros(1))


def test_a_section_that_stands_twice_hands_its_weight_over() -> None:
    """In G and in the ports of a torque, both in what it moves and in what its law looks at."""
    smaller = fit_at(STRUCTURE, CASCADE, (friction(),))
    a1, a2, b1, b2 = CASCADE.sections[:, 0]
    twice = np.array([[a1, a1], [a2, a2], [0.4 * b1, 0.6 * b1], [0.3 * b2, 0.7 * b2]])
    ports = friction().ports
    assert ports is not None
    shared = replace(
        ports,
        sections=np.concatenate([0.2 * ports.sections, 0.8 * ports.sections], axis=1),
        signal_sections=np.concatenate([0.9 * ports.signal_sections, 0.1 * ports.signal_sections], axis=1),
    )
    larger = fit_at(
        replace(STRUCTURE, sections=2),
        replace(CASCADE, sections=twice, starts=np.zeros((1, 5))),
        (replace(friction(), ports=shared),),
    )
    assert abs(larger.log_likelihood - smaller.log_likelihood) < 1
    for found in smaller_cascades(larger):
        assert found.structure == smaller.structure
        assert abs(found.log_likelihood - smaller.log_likelihood) < 1


def test_where_derivatives_overflow_the_weights_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a motion that grows: a smaller cascade is begun all the same, with what the others had."""
    fit = fit_at(STRUCTURE, CASCADE, (friction(),))

    def overflowing(_: JointFit) -> None:
        raise FloatingPointError

    monkeypatch.setattr(JointFit, "factor", overflowing)
    (found,) = smaller_cascades(fit)
    assert found.structure == replace(STRUCTURE, sections=0)
    assert found.values.cascade.integrator_residue == pytest.approx(CASCADE.integrator_residue)
