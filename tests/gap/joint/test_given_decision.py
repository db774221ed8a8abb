"""What is left beyond the stated noise is said to be something else; what a label removes stays said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import SIGMA, measured
from test_given_search import SAMPLES, model

from bayes_hw.gap.joint.given_decision import GivenEvidence, decide_given
from bayes_hw.gap.joint.given_search import best_base
from bayes_hw.gap.joint.joint_decision import JointDecision
from bayes_hw.gap.joint.joint_search import JointAnswer
from bayes_hw.gap.joint.readings import read_faults
from bayes_hw.gap.joint.remainder import remainder_of


def answer_of(records: list, fitted: list, nats: dict[str, float]) -> JointAnswer:  # type: ignore[type-arg]
    """The base on `records`, and on `fitted` as though the effects of `nats` had changed them so."""
    base, fit = best_base(records, model()), best_base(fitted, model())
    return JointAnswer(fit, base, nats, {}, read_faults(base), remainder_of(fit))


def decided(found: JointAnswer, noise: float) -> JointDecision:
    return decide_given(GivenEvidence.of(found, noise))


def disturbed(size: float) -> list:  # type: ignore[type-arg]
    """White errors of several times the noise beside it."""
    plain = measured((), SAMPLES, (1, 2))
    rng = np.random.default_rng(5)
    return [replace(r, y=r.y + size * SIGMA * rng.standard_normal(SAMPLES)) for r in plain]


def test_noise_as_stated_is_nothing_and_more_is_something() -> None:
    quiet, loud = measured((), SAMPLES, (1, 2)), disturbed(3.0)
    assert decided(answer_of(quiet, quiet, {}), SIGMA).answer == ()
    said = decided(answer_of(loud, loud, {}), SIGMA)
    assert said.answer == ("other",)
    assert said.probability["none"] < 0.15
    assert decided(answer_of(loud, loud, {}), float("nan")).answer == ()


def test_a_label_that_removes_most_of_the_error_stays() -> None:
    louder, loud = disturbed(9.0), disturbed(2.0)
    kept = decided(answer_of(louder, loud, {"friction": 300.0}), SIGMA)
    assert kept.answer == ("friction", "other")
    lost = decided(answer_of(loud, loud, {"friction": 300.0}), SIGMA)
    assert lost.answer == ("other",)
    assert lost.probability["friction"] <= 0.3
