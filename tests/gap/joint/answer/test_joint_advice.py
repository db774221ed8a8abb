"""What is said of an answer's size and what is to be done about it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from bayes_hw.gap.joint.answer.advice import advice_on
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.residuals.reading_parts import EVERY
from bayes_hw.gap.joint.search.joint_search import JointAnswer


def test_a_rhythm_of_the_readings_is_said_beside_what_is_done_of_any_unknown_cause() -> None:
    posterior = cast(JointPosterior, SimpleNamespace(units={}, effects={}))
    rates = SimpleNamespace(units=SimpleNamespace(output="deg", input="deg/s"))
    fit = SimpleNamespace(response=SimpleNamespace(records=[rates]))
    for parameters, first in (({EVERY: 8.0}, "repeats every 8 samples"), ({}, "use the bands")):
        found = SimpleNamespace(fit=fit, readings=SimpleNamespace(parameters=parameters))
        said = advice_on(("other",), posterior, cast(JointAnswer, found))
        assert len(said) == 1 + len(parameters)
        assert first in said[0]
        assert all(one.startswith("cause unknown: ") for one in said)
