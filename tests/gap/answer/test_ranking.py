"""The table of explanations: the best of every set of labels, then those that came less far, once each."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayes_hw.gap.answer.ranking import ranking


def fitted(name: str, labels: tuple[str, ...], rmse: float) -> Any:
    effects = tuple(SimpleNamespace(name=name) for _ in labels)
    return SimpleNamespace(hypothesis=SimpleNamespace(labels=labels, effects=effects), rmse=rmse)


def explained(name: str, labels: tuple[str, ...], rmse: float, log_evidence: float) -> Any:
    return SimpleNamespace(
        name=name, labels=labels, log_evidence=log_evidence, fit=fitted(name, labels, rmse),
        chaotic_response=False, cannot_be_predicted=False, stochastic=None,
    )  # fmt: skip


@pytest.fixture
def attribution() -> Any:
    base = explained("base", (), 0.05, 100.0)
    friction = explained("friction, Coulomb", ("friction",), 0.01, 900.0)
    worse = explained("friction, Stribeck", ("friction",), 0.011, 880.0)
    pair = explained("friction and bias", ("friction", "command_bias"), 0.0099, 903.0)
    singles = [
        fitted("ripple", ("torque_ripple",), 0.04),
        fitted("bias, late", ("command_bias",), 0.045),
        fitted("bias", ("command_bias",), 0.03),
        fitted("friction, Coulomb", ("friction",), 0.01),
    ]
    return SimpleNamespace(base=base, explanations=[base, friction, worse, pair], singles=singles)


def test_every_set_of_labels_stands_once_best_first(attribution: Any) -> None:
    found = ranking(attribution, 0.01, {})
    assert [one.labels for one in found] == [
        ("friction", "command_bias"), ("friction",), (), ("command_bias",), ("torque_ripple",),
    ]  # fmt: skip
    assert [one.name for one in found][1] == "friction, Coulomb"
    assert [one.name for one in found][3] == "bias"


def test_gains_count_from_the_base_and_singles_have_none(attribution: Any) -> None:
    found = {one.labels: one for one in ranking(attribution, 0.01, {})}
    assert found["friction",].gain == pytest.approx(800.0)
    assert found[()].gain == 0.0 and found[()].closes is None
    assert found["torque_ripple",].gain is None


def test_what_closes_is_a_share_of_the_error_that_is_not_noise(attribution: Any) -> None:
    kept: Any = object()
    found = {one.labels: one for one in ranking(attribution, 0.01, {("friction",): kept})}
    assert found["friction",].closes == pytest.approx(1.0)
    assert found["command_bias",].closes == pytest.approx((0.05**2 - 0.03**2) / (0.05**2 - 0.01**2))
    assert [one.left_out for one in (found["friction",], found[()])] == [kept, None]
    noise_alone = {one.labels: one for one in ranking(attribution, 0.05, {})}
    assert noise_alone["friction",].closes is None
