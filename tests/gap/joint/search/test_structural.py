"""What effects ask for: a law that begins to look at a motion of its own is held against other laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import form, measured, response_with, torque

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search import structural
from bayes_hw.gap.joint.search.structural import looking
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.time_budget import at_most

SAMPLES = 400


@pytest.fixture
def blind() -> JointFit:
    """Friction of the load, which looks at its speed alone."""
    rub = torque(form("friction", "Coulomb, load"), (1e-4,), 2e-4, 0.0)
    assert rub.ports is not None
    rub = replace(rub, ports=replace(rub.ports, signal=False))
    response, values = response_with((rub,), SAMPLES)
    response = replace(response, records=measured((rub,), SAMPLES, (1,)))
    return JointFit(response, evaluate(response, response.coordinates(values)))


@pytest.mark.parametrize("sees", [True, False])
def test_laws_are_exchanged_as_one_begins_to_look_for_itself(
    sees: bool, blind: JointFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And not before: a larger G alone asks for no other law."""
    better = blind.with_signal(0) if sees else blind
    better = replace(better, point=replace(better.point, log_likelihood=better.point.log_likelihood + 100))
    gap = blind.moved(blind.structure, JointValues(blind.values.cascade))
    gap = replace(gap, point=replace(gap.point, log_likelihood=better.point.log_likelihood + 100))
    monkeypatch.setattr(structural, "port_candidates", lambda _: [better])
    monkeypatch.setattr(structural, "larger_cascades", lambda _: [])
    monkeypatch.setattr(structural, "descended_each", lambda fits, _: list(fits))
    monkeypatch.setattr(structural, "raced", lambda fits, _: list(fits))
    monkeypatch.setattr(structural, "exchanged", lambda _: [gap])
    assert looking(better) == int(sees)
    assert structural.structural(blind) is (gap if sees else better)


def test_out_of_time_nothing_is_asked(blind: JointFit) -> None:
    with at_most(0.0):
        assert structural.structural(blind) is blind
    assert np.isfinite(blind.score)
