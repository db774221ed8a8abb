"""The judgement on hand-made numbers."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest
from decision_constants import CONSTANTS, LABELS

from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.judgement import (
    Claim,
    Judgement,
    Remains,
    choose_labels,
    judge,
    probability_of_other,
)
from bayes_hw.gap.criticism.block_functions import FLOOR
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic

NOTHING = Remains(())


def judged(
    chosen: tuple[str, ...], scores: dict[tuple[str, ...], float], remains: Remains = NOTHING
) -> Judgement:
    return judge(chosen, scores, remains, LABELS, CONSTANTS)


def test_constants_come_with_the_program() -> None:
    constants = Calibration.built_in()
    assert all(getattr(constants, field.name) > 0 for field in fields(constants))
    assert constants.floor < 0.05


@pytest.mark.parametrize(("size", "possible", "chosen"), [
    (0.31, True, ("backlash", "friction")), (0.29, True, ("friction",)), (0.31, False, ("friction",)),
])  # fmt: skip
def test_a_pair_is_chosen_where_its_demands_are_met(
    size: float, possible: bool, chosen: tuple[str, ...]
) -> None:
    """A pair that is not earned has no probability either, whatever its evidence."""
    pair = Claim(80.0, possible, (("pair_gain", 40.0), ("pair_size", size)))
    claims = {(): Claim(0.0), ("friction",): Claim(40.0), ("backlash", "friction"): pair}
    found, scores = choose_labels(claims, CONSTANTS)
    assert found == chosen
    assert (scores["backlash", "friction"] == 80.0) == (len(chosen) == 2)


def test_probabilities_are_tempered_and_sum_over_sets() -> None:
    """Worked by hand: sets at 0, 20 and 25 with handicaps 0, 10, 10 and temperature 5."""
    scores = {(): 0.0, ("friction",): 25.0, ("backlash",): 20.0}
    judgement = judged(("friction",), scores)
    weights = {"none": 2.718281828 ** (-15 / 5), "friction": 1.0, "backlash": 2.718281828**-1}
    total = sum(weights.values())
    assert judgement.answer == ("friction",)
    for name, weight in weights.items():
        assert judgement.probability[name] == pytest.approx(weight / total, rel=1e-6)
    assert set(judgement.probability) == {*LABELS, "none", "other"}
    assert judgement.probability["wind"] == CONSTANTS.floor
    assert sum(judgement.sets.values()) + judgement.probability["other"] == pytest.approx(1, abs=2e-3)


def test_a_pair_counts_for_both_labels() -> None:
    scores = {(): 0.0, ("friction",): 40.0, ("friction", "wind"): 90.0}
    judgement = judged(("friction", "wind"), scores)
    assert judgement.probability["friction"] == judgement.probability["wind"] > 0.98
    assert judgement.probability["friction"] <= 1 - CONSTANTS.floor


def test_other_needs_gain_and_size() -> None:
    """Even odds at both thresholds, joined by what is expected; one without the other is nothing."""

    def other(negative_log_p: float, size: float, gap: float = 0.0) -> float:
        return probability_of_other(
            Remains((ResidualDiagnostic("step", negative_log_p, size),), gap), CONSTANTS
        )

    assert other(40.0, 0.3) == pytest.approx(0.5)
    assert other(4000.0, 0.9) > 0.95
    assert other(4000.0, 0.03) < 0.05 and other(4.0, 0.9) < 0.05
    assert other(40.0, 0.5, gap=0.4 / CONSTANTS.left_share) == pytest.approx(0.5)
    assert other(-1.0, 0.9) == pytest.approx(0, abs=1e-10)
    assert probability_of_other(NOTHING, CONSTANTS) == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("kind", ["function at input", "gusts after a limit"])
def test_less_counts_as_left_under_slow_noise(kind: str) -> None:
    left = (ResidualDiagnostic(kind, CONSTANTS.slow_left_surprise, 3.0),)
    assert probability_of_other(Remains(left, drifts=True), CONSTANTS) == pytest.approx(0.5)
    assert probability_of_other(Remains(left), CONSTANTS) < 0.25


def test_a_plain_remainder_needs_no_share_of_the_gap() -> None:
    """A function that takes little for certain counts; not where samples cannot be followed, or less sure."""

    def other(left: ResidualDiagnostic, **remains: bool) -> float:
        return probability_of_other(Remains((left,), gap=20.0, **remains), CONSTANTS)

    negative_log_p, size = CONSTANTS.plain_surprise, CONSTANTS.plain_size
    left = ResidualDiagnostic("function at sensor in detail", 4 * negative_log_p, 3 * size)
    assert other(left) > 0.9
    assert (
        other(replace(left, size=size))
        == other(replace(left, negative_log_p=negative_log_p))
        == pytest.approx(0.5)
    )
    assert max(other(left, loose=True), other(left, drifts=True), other(replace(left, kind="spread"))) < 0.3


def test_a_name_in_a_block_where_nothing_enters_is_not_kept() -> None:
    """Even odds at the constant, every block having the floor; of two effects the likelier block counts, no
    name is never unlikely, and little tells no block from another."""

    def other(sensor: float, *named: str) -> float:
        blocks = {"drive": 3.0, "sensor": sensor, "input": 0.0, "linear": 0.0}
        return probability_of_other(Remains((), blocks=blocks, named=named), CONSTANTS)

    even = (FLOOR + 1) * (1 / CONSTANTS.named_block - 3) ** 0.5 - 1
    assert other(even, "drive") == pytest.approx(0.5)
    assert other(10 * even, "linear") > 0.99
    assert other(10 * even, "sensor") == other(10 * even, "drive", "sensor") < 0.02
    assert other(even) == pytest.approx(0, abs=1e-10)
    assert other(FLOOR, "drive") < other(2 * FLOOR, "drive") < 0.5
    remains = Remains((), blocks={"drive": 0.0, "sensor": 60.0}, named=("drive",))
    assert judged(("friction",), {(): 0.0, ("friction",): 25.0}, remains).answer == ("other",)


def test_how_sure_a_block_is_stated_changes_no_answer() -> None:
    """Worked by hand: shares of the odds."""
    remains = Remains((), blocks={"drive": 0.0, "sensor": 2.0, "input": 1.0}, named=("drive",))
    constants = replace(CONSTANTS, block_sharpness=3.0)
    found = judge(("friction",), {(): 0.0, ("friction",): 25.0}, remains, LABELS, constants)
    assert found.blocks == pytest.approx({"drive": 1 / 36, "sensor": 27 / 36, "input": 8 / 36})
    before = judge(("friction",), {(): 0.0, ("friction",): 25.0}, remains, LABELS, CONSTANTS)
    assert found.probability == before.probability


def test_chaos_that_follows_the_command_is_not_believed() -> None:
    """Even odds at the constant, however far ahead the effect is."""
    share = CONSTANTS.chaos_predicted
    assert probability_of_other(Remains((), predicted=share), CONSTANTS) == pytest.approx(0.5)
    scores = {(): 0.0, ("backlash",): 900.0}
    for times, answer in ((0.5, ("backlash",)), (2.0, ("other",))):
        remains = Remains((), loose=True, excused=True, predicted=times * share)
        assert judge(("backlash",), scores, remains, LABELS, CONSTANTS).answer == answer


def test_other_takes_the_place_of_a_name() -> None:
    remains = Remains((ResidualDiagnostic("line in time", 4000.0, 0.9),))
    judgement = judged(("friction",), {(): 0.0, ("friction",): 25.0}, remains)
    assert judgement.answer == ("other",)
    assert judgement.probability["other"] > 0.95 > 0.05 > judgement.probability["friction"]


@pytest.mark.parametrize("excused", [False, True])
def test_an_effect_of_numbers_that_are_unheard_of_explains_nothing(excused: bool) -> None:
    """However far ahead it is, and where all that it leaves is excused: `other`, as sure as that can be."""
    scores = {(): 0.0, ("unmodelled_mode",): 900.0}
    for unheard_of, answer in ((False, ("unmodelled_mode",)), (True, ("other",))):
        remains = Remains((), loose=excused, excused=excused, unheard_of=unheard_of)
        judgement = judge(("unmodelled_mode",), scores, remains, LABELS, CONSTANTS)
        assert judgement.answer == answer
    assert judgement.probability["other"] == pytest.approx(min(CONSTANTS.other_ceiling, 1 - CONSTANTS.floor))


def test_a_search_that_found_nothing_may_have_missed_it() -> None:
    """However much is left, `other` is no surer than its ceiling, and still the answer."""
    constants = replace(CONSTANTS, other_ceiling=0.9)
    remains = Remains((ResidualDiagnostic("spectrum", 1e4, 3.0),))
    judgement = judge((), {(): 0.0}, remains, LABELS, constants)
    assert judgement.answer == ("other",)
    assert judgement.probability["other"] == pytest.approx(0.9)


@pytest.mark.parametrize(("kind", "answer"), [("spread", ("backlash",)), ("line in time", ("other",))])
def test_chaos_far_ahead_excuses_what_it_leaves_but_no_line(kind: str, answer: tuple[str, ...]) -> None:
    """A sine that lasts is corrected away sample by sample, so that any followed motion seems far ahead."""
    remains = Remains((ResidualDiagnostic(kind, 1e4, 0.97),), gap=0.5, loose=True, excused=True)
    judgement = judge(("backlash",), {(): 0.0, ("backlash",): 900.0}, remains, LABELS, CONSTANTS)
    assert judgement.answer == answer
