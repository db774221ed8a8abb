"""Constants fitted on ballots that were drawn from known odds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind_check.ballot import Ballot
from blind_check.calibrate import (
    BY_HAND,
    DOUBTS,
    STEPS,
    CalibrationCase,
    CalibrationFit,
    calibrate,
    fit_doubts,
    moved,
    names_fitted,
    total_score,
)

from bayes_hw.gap.answer.judgement import Claim, Remains
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.progress import Progress

QUIET = Progress(quiet=True)
LABELS = ("friction", "wind")


def drawn(temperature: float, number: int, seed: int) -> list[CalibrationCase]:
    """Evidence spread evenly about the handicap; the truth is drawn with the odds it has at `temperature`."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(number):
        gain = BY_HAND.single_gain + rng.uniform(-40.0, 40.0)
        probability = 1 / (1 + np.exp(-(gain - BY_HAND.single_gain) / temperature))
        claims = {(): Claim(0.0), ("friction",): Claim(gain)}
        ballot = Ballot(claims, dict.fromkeys(claims, Remains(())), LABELS)
        cases.append(CalibrationCase.of(ballot, ["friction"] if rng.random() < probability else []))
    return cases


@pytest.mark.slow
def test_the_temperature_that_made_the_cases_is_found() -> None:
    """11 of a start at 6: within what 400 cases tell; better on cases left out, and so adopted. Constants
    that no case depends on stay."""
    fit = calibrate(drawn(11.0, 400, 1), QUIET)
    assert fit.fitted.temperature == pytest.approx(11.0, rel=0.2)
    assert fit.gain[0] > 2 * fit.gain[1] > 0
    assert fit.adopted == fit.fitted
    untouched = {"pair_gain", "pair_size", "slow_pair_size", "left_surprise", "left_size", "pair_ceiling"}
    assert all(getattr(fit.fitted, name) == getattr(BY_HAND, name) for name in untouched)


@pytest.mark.slow
def test_the_sharpness_of_blocks_that_made_the_cases_is_found() -> None:
    """The true block is drawn with the odds it has at 3.5, of a start at 2.2; worked by hand for one case."""
    rng = np.random.default_rng(4)
    cases, blocks = [], {}
    for label, block in LABEL_BLOCKS.items():
        blocks.setdefault(block, label)
    for _ in range(400):
        negative_log_p = dict(zip(blocks, rng.uniform(5.0, 20.0, len(blocks)).tolist(), strict=True))
        odds = (1 + np.array(list(negative_log_p.values()))) ** 3.5
        ballot = Ballot({(): Claim(0.0)}, {(): Remains((), blocks=negative_log_p)}, tuple(blocks.values()))
        true = str(rng.choice(list(blocks), p=odds / odds.sum()))
        cases.append(CalibrationCase.of(ballot, [blocks[true]]))
    fit = calibrate(cases, QUIET)
    assert fit.fitted.block_sharpness == pytest.approx(3.5, rel=0.2)
    assert cases[-1].block == true
    without, stated = replace(cases[-1], block=""), fit.as_fitted[-1].blocks[true]
    difference = cases[-1].log_score(fit.as_fitted[-1]) - without.log_score(fit.as_fitted[-1])
    assert difference == pytest.approx(np.log(stated))
    assert CalibrationCase.of(ballot, ["wind", "friction"]).block == ""


@pytest.mark.slow
def test_constants_that_are_right_stay() -> None:
    """Cases drawn at the temperature by hand: the fit stays near, and gains nothing clear of chance."""
    fit = calibrate(drawn(BY_HAND.temperature, 400, 2), QUIET)
    assert fit.fitted.temperature == pytest.approx(BY_HAND.temperature, rel=0.3)
    assert abs(fit.gain[0]) < 3 * fit.gain[1] + 1e-9


@pytest.fixture(scope="module")
def fit_of_temperature() -> CalibrationFit:
    """Of 100 cases whose temperature alone is off."""
    return calibrate(drawn(11.0, 100, 3), QUIET)


@pytest.mark.slow
def test_constants_that_predict_worse_are_not_adopted(fit_of_temperature: CalibrationFit) -> None:
    """Exchanged: what was by hand scores the more on cases left out."""
    fit = fit_of_temperature
    worse = replace(fit, by_hand=fit.left_out, left_out=fit.by_hand)
    assert fit.gain[0] == pytest.approx(-worse.gain[0])
    assert fit.adopted == fit.fitted != BY_HAND == worse.adopted


@pytest.mark.slow
def test_of_fits_as_good_the_one_of_fewer_constants_is_kept(fit_of_temperature: CalibrationFit) -> None:
    """The temperature is all that is off: a fit of every constant finds no more, and is not kept."""
    fit = fit_of_temperature
    assert fit.names == DOUBTS
    few, many = (fit.gains[len(names)] for names in (DOUBTS, names_fitted()))
    assert few[0] >= many[0] - many[1]
    assert fit.gain == few
    moved_ones = {name for name in names_fitted() if getattr(fit.fitted, name) != getattr(BY_HAND, name)}
    assert moved_ones <= set(DOUBTS)


@pytest.mark.slow
def test_a_threshold_is_fitted_where_that_is_clearly_better() -> None:
    """Right are the pairs whose second effect takes more than 0.3 times the noise; by hand it is 0.2."""
    rng = np.random.default_rng(10)
    cases = []
    for size in rng.uniform(0.1, 0.6, 100):
        claims = {(): Claim(0.0), LABELS: Claim(1000.0, demands=(("pair_size", float(size)),))}
        ballot = Ballot(claims, dict.fromkeys(claims, Remains(())), LABELS)
        cases.append(CalibrationCase.of(ballot, LABELS if size > 0.3 else []))
    fit = calibrate(cases, QUIET)
    assert fit.names == names_fitted()
    assert fit.fitted.pair_size == pytest.approx(0.3, rel=0.1)


def test_scores_are_worked_by_hand() -> None:
    """One case: probabilities 0.5 of other, the rest as judged; the sum of logarithms of what is true."""
    left = ResidualDiagnostic("step", BY_HAND.left_surprise, 10.0)
    ballot = Ballot({(): Claim(0.0)}, {(): Remains((left,))}, ("friction",))
    for effects, true in ((["other"], "other"), ([], "none")):
        case = CalibrationCase.of(ballot, effects)
        judgement = ballot.judge(BY_HAND)
        assert judgement.probability["other"] == pytest.approx(0.5)
        stated = judgement.probability
        expected = sum(np.log(p if name == true else 1 - p) for name, p in stated.items())
        assert case.log_score(judgement) == pytest.approx(expected)
        assert total_score([case, case], BY_HAND) == pytest.approx(2 * expected)
        assert case.right(judgement) == (true == "none")


@pytest.mark.parametrize("step", [STEPS[0], STEPS[-1]])
def test_constants_stay_sensible_at_both_ends(step: float) -> None:
    """Positive, and ceilings below one."""
    far = moved(BY_HAND, dict.fromkeys(names_fitted(), float(step)))
    assert all(getattr(far, name) > 0 for name in names_fitted())
    assert max(far.pair_ceiling, far.other_ceiling) < 1
    assert min(far.pair_ceiling, far.other_ceiling) > 0.5


@pytest.mark.slow
def test_doubts_are_those_of_cases_left_out() -> None:
    """Every case has a demand of its own size that tells nothing, and four pairs of five are right: what the
    answer to a fresh case is said to be sure of is kept."""
    fit = calibrate(pairs_by_chance(120, 5, 0.8), QUIET)
    fresh = pairs_by_chance(1000, 6, 0.8)
    judged = [(case, case.ballot.judge(fit.fitted)) for case in fresh]
    said = [(case, found) for case, found in judged if len(found.answer) == 2]
    stated = np.mean([min(found.probability[label] for label in found.answer) for _, found in said])
    assert stated == pytest.approx(np.mean([case.right(found) for case, found in said]), abs=0.04)


def pairs_by_chance(number: int, seed: int, share: float) -> list[CalibrationCase]:
    """Two effects far ahead of one; `share` of them are right, which no size tells, else nothing is."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(number):
        demands = (("pair_size", float(rng.uniform(0.1, 0.4))),)
        claims = {
            (): Claim(0.0),
            ("friction",): Claim(500.0),
            LABELS: Claim(1000.0, demands=demands),
        }
        ballot = Ballot(claims, dict.fromkeys(claims, Remains(())), LABELS)
        cases.append(CalibrationCase.of(ballot, LABELS if rng.random() < share else []))
    return cases


def test_doubts_change_no_answer() -> None:
    """From one end of the search to the other."""
    cases = [*drawn(6.0, 40, 7), *pairs_by_chance(40, 8, 0.5)]
    cases.append(CalibrationCase.of(ballot_of_other(), ["other"]))
    for step in (STEPS[0], STEPS[-1]):
        far = moved(BY_HAND, dict.fromkeys(DOUBTS, float(step)))
        for case in cases:
            assert case.ballot.judge(far).answer == case.ballot.judge(BY_HAND).answer


def ballot_of_other() -> Ballot:
    """What is left is three times what makes `other` even odds."""
    left = ResidualDiagnostic("step", 3 * BY_HAND.left_surprise, 10.0)
    return Ballot({(): Claim(0.0)}, {(): Remains((left,))}, ("friction",))


def struck_with_blocks_by_chance(number: int, seed: int, share: float) -> list[CalibrationCase]:
    """Functions find twice as much at one block as at another, and are right in this `share`."""
    rng = np.random.default_rng(seed)
    left = ResidualDiagnostic("step", 3 * BY_HAND.left_surprise, 10.0)
    blocks = {LABEL_BLOCKS["friction"]: 9.0, LABEL_BLOCKS["wind"]: 19.0}
    ballot = Ballot({(): Claim(0.0)}, {(): Remains((left,), blocks=blocks)}, ("encoder_drift",))
    struck = ["wind" if rng.random() < share else "friction" for _ in range(number)]
    return [CalibrationCase.without(ballot, label) for label in struck]


@pytest.mark.slow
def test_struck_cases_tell_how_sure_blocks_are() -> None:
    """Functions know of no catalogue: two to the power of the sharpness are their odds to be right."""
    share = 1 / (1 + 2**-3.0)
    fitted = fit_doubts([(case, BY_HAND) for case in struck_with_blocks_by_chance(4000, 11, share)])
    untold = fit_doubts([(case, BY_HAND) for case in drawn(11.0, 60, 9)])
    assert fitted["block_sharpness"] == pytest.approx(3.0, abs=0.3)
    assert untold["block_sharpness"] == BY_HAND.block_sharpness


def test_struck_cases_count_where_answers_are_decided_and_leave_other_doubts_alone() -> None:
    """`other` is true of them, at half a case's weight, and the block of what was struck."""
    struck = CalibrationCase.without(ballot_of_other(), "wind")
    assert struck.true == {"other"}
    assert struck.block == LABEL_BLOCKS["wind"]
    judged = struck.ballot.judge(BY_HAND)
    assert struck.right(judged)
    assert total_score([struck], BY_HAND) == pytest.approx(0.5 * struck.log_score(judged))
    complete = [(case, BY_HAND) for case in drawn(11.0, 60, 9)]
    assert fit_doubts(complete) == fit_doubts([*complete, *[(struck, BY_HAND)] * 60])
    assert fit_doubts(complete).keys() == set(DOUBTS)
