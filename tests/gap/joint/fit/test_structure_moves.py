"""A G that is grown on for its posterior, and the explanation itself in the structure of that G."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, form, measured, scale, torque

from bayes_hw.gap.joint import inferred
from bayes_hw.gap.joint.fit import structure_moves
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.structure_moves import widened
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 600


@pytest.fixture
def every_pole_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(structure_moves, "_akaike", lambda fit: fit.log_likelihood)


@pytest.mark.usefixtures("every_pole_taken")
@pytest.mark.parametrize("with_friction", [False, True])
def test_the_explanation_keeps_its_response_in_the_wider_structure(with_friction: bool) -> None:
    effects = (torque(form("friction", "Coulomb, load"), (1e-4,), 2e-4),) if with_friction else ()
    response = JointResponse(STRUCTURE, effects, measured(effects, SAMPLES, (1, 2)), scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, effects))))
    wider, extensions = widened(fit.descended())
    same = fit.descended()
    for extend in extensions:
        same = extend(same)
    assert len(extensions) == 2
    assert same.structure == wider.structure
    assert wider.log_likelihood > fit.descended().log_likelihood
    for one, other in zip(same.point.residuals, fit.descended().point.residuals, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.usefixtures("every_pole_taken")
def test_the_posterior_predicts_as_the_explanation_that_was_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    records = tuple(measured((), SAMPLES, (1, 2)))
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    chosen = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()
    answer = JointAnswer(chosen, chosen, {}, {}, read_faults(chosen), remainder_of(chosen))
    monkeypatch.setattr(inferred, "search", lambda *_: answer)
    posterior = inferred.infer_alone(
        records, records, np.inf, lambda _: None, np.random.default_rng(1)
    ).posterior
    assert posterior.fit.structure != chosen.structure
    for number in range(len(records)):
        ours = posterior.fit.response.along(posterior.fit.values, number).y
        np.testing.assert_allclose(ours, chosen.response.along(chosen.values, number).y, atol=1e-9)
    assert posterior.coordinates.shape[1] == len(posterior.fit.point.coordinates)
    assert len(posterior.sections) == 1
    own, theirs = (linear_block(fit.structure, fit.values.cascade) for fit in (posterior.fit, chosen))
    assert len(own.poles) == len(theirs.poles)
    np.testing.assert_allclose(np.sort_complex(own.zeros), np.sort_complex(theirs.zeros), atol=1e-9)
