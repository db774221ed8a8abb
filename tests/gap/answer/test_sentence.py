"""Numbers of the verdict in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayes_hw.gap.answer import sentence
from bayes_hw.gap.answer.sentence import _amount, _of_the_gap, consequence
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic


@pytest.mark.parametrize(
    ("mean", "sd", "text"),
    [
        (0.98, 0.0001, "0.9800 +- 0.0001 deg"),
        (23.27, 0.19, "23.3 +- 0.2 deg"),
        (123456.0, 2300.0, "123000 +- 2000 deg"),
        (1.2e-9, 3e-10, "1.2e-09 +- 3e-10 deg"),
        (-0.4, 0.5, "-0.4 +- 0.5 deg"),
        (0.25, 0.0, "0.25 deg"),
        (0.06311144, 6e-8, "0.063111 deg"),
    ],
)
def test_amounts_are_rounded_by_their_deviation(mean: float, sd: float, text: str) -> None:
    assert _amount(Estimate(mean, sd, (mean - sd, mean + sd), "deg")) == text


@pytest.mark.parametrize(
    ("tracked", "text"),
    [
        (True, "With it in the model, 88 % [83, 92] of the avoidable error on the record held out is gone."),
        (
            False,
            "No simulation follows it: what knowing of it improves is the band and the model's own numbers, "
            "by which 88 % [83, 92] of the avoidable error on the record held out are gone.",
        ),
    ],
)
def test_what_is_random_is_not_said_to_be_removed(tracked: bool, text: str) -> None:
    gap = Closure(0.3, 0.1, 0.01, 0.88, (0.83, 0.92))
    assert consequence(gap, "it", tracked) == text


def answered(answer: tuple[str, ...], noise: float, before: float) -> Any:
    gap = Closure(before, noise, noise, 0.9, (0.85, 0.95))
    effects = (SimpleNamespace(block="drive", label="friction", name="friction, Coulomb"),)
    fit = SimpleNamespace(hypothesis=SimpleNamespace(effects=effects))
    explanation = SimpleNamespace(fit=fit, log_evidence=60.0, labels=("friction",))
    return SimpleNamespace(
        verdict=SimpleNamespace(
            answer=answer, gap_holdout=gap, probability={"none": 0.97, "friction": 0.96}, parameters={}
        ),
        decision=SimpleNamespace(explanation=explanation),
        attribution=SimpleNamespace(base=SimpleNamespace(log_evidence=10.0)),
    )


def test_the_gap_is_stated_in_multiples_of_the_noise() -> None:
    """sqrt(0.05^2 - 0.03^2) / 0.03 = 1.33."""
    said = _of_the_gap(answered(("friction",), 0.03, 0.05))
    assert said.startswith(
        "Model and records differ by 1.3 times the noise; what the model lacks is friction"
    )
    assert "(96 % sure)" in said


@pytest.mark.parametrize("unheard_of", [[], ["friction would need a size of 3, beyond what any has"]])
def test_why_nothing_is_named_is_said(unheard_of: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """What the best of the known effects would need that none has, else what stays beside it."""
    monkeypatch.setattr(sentence, "of_the_unheard_of", lambda _: unheard_of)
    monkeypatch.setattr(sentence, "_entrance", lambda _: "It acts somewhere.")
    found = answered(("other",), 0.03, 0.05)
    found.verdict.probability["other"] = 0.9
    found.decision.leftovers = [ResidualDiagnostic("step", 50.0, 0.7)]
    said = _of_the_gap(found)
    assert ("what stays beside the best of them (friction) is 0.7 times the noise" in said) == (
        not unheard_of
    )
    assert all(f"(90 % sure): {why}. It acts" in said for why in unheard_of)


def test_no_gap_is_said_as_one() -> None:
    said = _of_the_gap(answered((), 0.03, 0.029))
    assert said.startswith("Nothing is missing from the model") and "(97 % sure)" in said
