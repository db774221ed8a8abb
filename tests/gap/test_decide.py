"""The decision from hand-made evidences."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayes_hw.gap.decide import (
    Calibration,
    best_of_sets,
    choose,
    decide,
    expected_left,
    probability_of_other,
    score,
)
from bayes_hw.gap.explanation import is_far_ahead
from bayes_hw.gap.leftover import Leftover

LABELS = ("friction", "backlash", "wind", "encoder_quantization")
CONSTANTS = Calibration(
    temperature=5.0, single_gain=10.0, pair_gain=12.0, pair_size=0.3, slow_pair_size=0.3, slow_pair_share=0.1,
    left_surprise=40.0, slow_left_surprise=15.0, left_size=0.3, left_share=0.05, loose_share=0.3,
    bent_share=0.2, left_sharpness=2.0, floor=0.001, sigma_log_sd=0.25, pair_ceiling=0.999,
    other_ceiling=0.999)  # fmt: skip


@dataclass
class Stub:
    """As much of an explanation as a decision looks at."""

    labels: tuple[str, ...]
    log_evidence: float
    rmse: float = 1.0
    encoder_sigma: float = 1.0
    stochastic: Any = None
    chaotic: bool = False
    lost_motion: bool = False
    strained: bool = False
    display: Any = None
    bent_gusts: float = 0.0

    @property
    def fit(self) -> Any:
        return SimpleNamespace(
            rmse=self.rmse, residuals=[np.zeros(1000)], whitener=SimpleNamespace(sigma=self.encoder_sigma)
        )


def chosen(*stubs: Stub, nominal: float = 1.0) -> tuple[str, ...]:
    return choose(SimpleNamespace(explanations=stubs), nominal, CONSTANTS)[0].labels  # type: ignore[arg-type]


def probabilities(answer: Stub, scores: dict[tuple[str, ...], float], left: list[Leftover]) -> Any:
    return decide(
        explanation=answer,  # type: ignore[arg-type]
        scores=scores,
        left=left,
        expected=0.0,
        labels=LABELS,
        calibration=CONSTANTS,
    )


def test_constants_come_with_the_program() -> None:
    constants = Calibration.built_in()
    assert all(getattr(constants, field.name) > 0 for field in fields(constants))
    assert constants.floor < 0.05


def test_the_best_form_stands_for_its_label() -> None:
    stubs = [Stub((), 0), Stub(("friction",), 20), Stub(("friction",), 30), Stub(("wind",), 5)]
    best = best_of_sets(SimpleNamespace(explanations=stubs))  # type: ignore[arg-type]
    assert {key: value.log_evidence for key, value in best.items()} == {
        (): 0, ("friction",): 30, ("wind",): 5,
    }  # fmt: skip


@pytest.mark.parametrize(("evidence", "counted"), [(350.0, 350.0), (345.0, 300.0)])
def test_lost_motion_counts_only_far_ahead_of_all_that_can_be_predicted(
    evidence: float, counted: float
) -> None:
    lost = Stub(("backlash",), evidence, chaotic=True, lost_motion=True)
    stubs = [Stub((), 0), Stub(("backlash",), 300, chaotic=True), lost, Stub(("friction",), 299)]
    best = best_of_sets(SimpleNamespace(explanations=stubs))  # type: ignore[arg-type]
    assert best["backlash",].log_evidence == counted
    assert is_far_ahead(stubs) == (counted == evidence)  # type: ignore[arg-type]


@pytest.mark.parametrize(("chaotic", "far_ahead", "answer"), [
    (True, True, ("backlash",)), (True, False, ("other",)), (False, True, ("other",)),
])  # fmt: skip
def test_what_chaos_far_ahead_leaves_is_no_other_cause(
    chaotic: bool, far_ahead: bool, answer: tuple[str, ...]
) -> None:
    best, left = Stub(("backlash",), 300, chaotic=chaotic), [Leftover("step", 1000.0, 3.0)]
    scores = {(): 0.0, ("backlash",): 300.0}
    decision = decide(best, scores, left, 0.0, LABELS, CONSTANTS, far_ahead)  # type: ignore[arg-type]
    assert decision.answer == answer


@pytest.mark.parametrize(("gain", "answer"), [(9.0, ()), (11.0, ("friction",))])
def test_an_effect_must_earn_its_name(gain: float, answer: tuple[str, ...]) -> None:
    assert chosen(Stub((), 0), Stub(("friction",), gain), Stub(("backlash",), gain - 5)) == answer


@pytest.mark.parametrize(
    ("evidence", "rmse", "answer"),
    [
        (55.0, 0.5, ("backlash", "friction")),
        (48.0, 0.5, ("friction",)),
        (55.0, 0.98, ("friction",)),
    ],
)
def test_both_of_a_pair_must_earn_their_places(evidence: float, rmse: float, answer: tuple[str, ...]) -> None:
    """In evidence against the better single, and in error removed."""
    singles = [Stub(("friction",), 40, rmse=1.0), Stub(("backlash",), 30, rmse=1.2)]
    assert chosen(Stub((), 0, rmse=2.0), *singles, Stub(("backlash", "friction"), evidence, rmse)) == answer


@pytest.mark.parametrize(("single", "pair", "named"), [(True, False, 2), (True, True, 1), (False, False, 1)])
def test_error_removed_does_not_count_where_a_base_far_off_made_up_for_it(
    single: bool, pair: bool, named: int
) -> None:
    """One effect alone does nearly as well as two, but only with base parameters that no nominal has."""
    friction = Stub(("friction",), 40, rmse=1.0, strained=single)
    backlash = Stub(("backlash",), 30, rmse=1.2)
    both = Stub(("backlash", "friction"), 55, rmse=0.99, strained=pair)
    assert len(chosen(Stub((), 0, rmse=2.0), friction, backlash, both)) == named


@pytest.mark.parametrize(("evidence", "strained", "alone_too", "answer"), [
    (260, False, False, ("backlash", "friction")),
    (240, False, False, ("backlash",)),
    (260, True, False, ("backlash",)),
    (260, True, True, ("backlash", "friction")),
    (240, True, True, ("backlash",)),
])  # fmt: skip
def test_beside_chaos_a_second_effect_must_be_far_ahead(
    evidence: float, strained: bool, alone_too: bool, answer: tuple[str, ...]
) -> None:
    """By more than small changes of a chaotic motion make, and without base parameters that either effect
    alone does not need as far off."""
    wind = SimpleNamespace(label="wind", size=4.0, display=None)
    lost = {"rmse": 4.0, "stochastic": wind, "chaotic": True, "lost_motion": True}
    alone = Stub(("backlash",), 200, strained=alone_too, **lost)
    both = Stub(("backlash", "friction"), evidence, strained=strained, **lost)
    friction = Stub(("friction",), 100, strained=alone_too)
    assert chosen(Stub((), 0), alone, friction, both) == answer


def test_rounded_data_are_rounded() -> None:
    """A lattice is a fact: it is chosen however the evidences compare."""
    rounded = ("encoder_quantization",)
    assert chosen(Stub((), 0), Stub(rounded, -50), Stub(("friction",), 40)) == rounded


def test_noise_unlike_the_nominal_counts_against_an_explanation() -> None:
    """Half the square of the log-ratio in standard deviations; bounded; nothing where none is nominal."""
    twice = Stub((), 100, encoder_sigma=2.0)
    assert score(twice, 1.0, CONSTANTS) == pytest.approx(100 - 0.5 * (0.6931472 / 0.25) ** 2)
    assert score(Stub((), 100, encoder_sigma=1e9), 1.0, CONSTANTS) == pytest.approx(-100)
    assert score(twice, float("nan"), CONSTANTS) == 100


def test_probabilities_are_tempered_and_sum_over_sets() -> None:
    """Worked by hand: sets at 0, 20 and 25 with handicaps 0, 10, 10 and temperature 5."""
    scores = {(): 0.0, ("friction",): 25.0, ("backlash",): 20.0}
    decision = probabilities(Stub(("friction",), 25), scores, [])
    weights = {"none": 2.718281828 ** (-15 / 5), "friction": 1.0, "backlash": 2.718281828**-1}
    total = sum(weights.values())
    assert decision.answer == ("friction",)
    for name, weight in weights.items():
        assert decision.probability[name] == pytest.approx(weight / total, rel=1e-6)
    assert set(decision.probability) == {*LABELS, "none", "other"}
    assert decision.probability["wind"] == CONSTANTS.floor
    assert sum(decision.sets.values()) + decision.probability["other"] == pytest.approx(1, abs=2e-3)


def test_a_pair_counts_for_both_labels() -> None:
    scores = {(): 0.0, ("friction",): 40.0, ("friction", "wind"): 90.0}
    decision = probabilities(Stub(("friction", "wind"), 90), scores, [])
    assert decision.probability["friction"] == decision.probability["wind"] > 0.98
    assert decision.probability["friction"] <= 1 - CONSTANTS.floor


def test_other_needs_gain_and_size() -> None:
    """Even odds at both thresholds, joined by what is expected; one without the other is nothing."""

    def other(gain: float, size: float, expected: float = 0.0) -> float:
        return probability_of_other([Leftover("step", gain, size)], expected, CONSTANTS)

    assert other(40.0, 0.3) == pytest.approx(0.5)
    assert other(4000.0, 0.9) > 0.95
    assert other(4000.0, 0.03) < 0.05 and other(4.0, 0.9) < 0.05
    assert other(40.0, 0.5, expected=0.4) == pytest.approx(0.5)
    assert other(-1.0, 0.9) == pytest.approx(0, abs=1e-10)
    assert probability_of_other([], 0.0, CONSTANTS) == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("kind", ["function at input", "gusts after a limit"])
def test_less_counts_as_left_under_slow_noise(kind: str) -> None:
    left = [Leftover(kind, CONSTANTS.slow_left_surprise, 3.0)]
    assert probability_of_other(left, 0.0, CONSTANTS, drifts=True) == pytest.approx(0.5)
    assert probability_of_other(left, 0.0, CONSTANTS) < 0.25


def test_other_takes_the_place_of_a_name() -> None:
    left = [Leftover("line in time", 4000.0, 0.9)]
    decision = probabilities(Stub(("friction",), 25), {(): 0.0, ("friction",): 25.0}, left)
    assert decision.answer == ("other",)
    assert decision.probability["other"] > 0.95 > 0.05 > decision.probability["friction"]
    assert decision.leftovers == tuple(left)


def test_what_even_a_right_explanation_may_leave() -> None:
    """A share of the gap, a larger one where the motion is chaotic or the display repeats or rounds."""
    base, plain = Stub((), 0, rmse=5.0), Stub(("friction",), 9, rmse=1.0)
    chaotic = Stub(("backlash",), 9, rmse=1.0, chaotic=True)
    rounded = Stub(("timing_jitter",), 9, rmse=1.0, display=object())
    gap = 24**0.5
    assert expected(base, plain) == pytest.approx(CONSTANTS.left_share * gap)
    bent = Stub(("cubic_stiffness", "wind"), 9, rmse=1.0, bent_gusts=3.0)
    assert expected(base, bent) == pytest.approx(np.hypot(CONSTANTS.left_share * gap, 0.2 * 3.0))
    assert expected(base, chaotic) == expected(base, rounded) == pytest.approx(CONSTANTS.loose_share * gap)


def expected(base: Stub, explanation: Stub) -> float:
    return expected_left(base, explanation, CONSTANTS)  # type: ignore[arg-type]


def test_under_slow_noise_the_innovations_tell() -> None:
    """A response beside a drift is earned by evidence a sample: plain errors hold the drift too."""

    def drifting(labels: tuple[str, ...], log_evidence: float, rmse: float) -> Stub:
        noise = SimpleNamespace(label="sensor_drift", size=2.0, display=None)
        return Stub(labels, log_evidence, rmse=rmse, stochastic=noise)

    base, alone = Stub((), 0.0, rmse=4.0), drifting(("sensor_drift",), 500.0, 1.8)
    pair = ("friction", "sensor_drift")
    assert chosen(base, alone, drifting(pair, 530.0, 2.9)) == pair
    assert chosen(base, alone, drifting(pair, 504.0, 2.9)) == ("sensor_drift",)


def test_a_search_that_found_nothing_may_have_missed_it() -> None:
    """However much is left, `other` is no surer than its ceiling, and still the answer."""
    base = Stub((), 0.0)
    left = [Leftover("spectrum", 1e4, 3.0)]
    constants = replace(CONSTANTS, other_ceiling=0.9)
    decision = decide(base, {(): 0.0}, left, 0.1, LABELS, constants)  # type: ignore[arg-type]
    assert decision.answer == ("other",)
    assert decision.probability["other"] == pytest.approx(0.9)
