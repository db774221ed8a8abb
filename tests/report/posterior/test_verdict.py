"""The first page says what is wrong first, and does not quote what the records do not show."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bayes_hw.identify.feedback import FeedbackTest
from bayes_hw.infer.own_check import Held, OwnCheck
from bayes_hw.infer.prediction import Coverage
from bayes_hw.infer.residual_tests import ResidualTest
from bayes_hw.infer.summary import Summary
from bayes_hw.report.posterior.verdict import badges, not_shown, verdict


def summary(mean, sd, unit):
    return Summary(mean, sd, mean, (mean - 2 * sd, mean + 2 * sd), 900.0, 800.0, 1.001, sd / 30, unit)


SUMMARIES = {
    "saturation.lower": summary(-0.3356, 0.0003, "deg/s"),
    "saturation.upper": summary(0.4401, 0.0009, "deg/s"),
    "dead_zone.half_width": summary(0.006, 0.0001, "deg"),
    "mode1.frequency_hz": summary(3.29, 0.01, "Hz"),
    "mode2.frequency_hz": summary(3.66, 0.02, "Hz"),
}


OPEN, CLOSED = FeedbackTest(15.0, 0.8, 0.01), FeedbackTest(900.0, 1e-99, 0.4)


def own_check(held, replicates):
    """A check in which one parameter was held so often, the others always."""
    parameters = ("saturation.upper", "dead_zone.half_width")
    counts = dict.fromkeys(parameters, Held(replicates, replicates))
    return OwnCheck(replicates, replicates, counts | {parameters[1]: Held(held, replicates)})


def analysis(
    *,
    converged=True,
    dominated=(),
    hidden=(),
    linear=83.0,
    passed=True,
    given=(),
    check=None,
    feedback=OPEN,
    power=1.0,
    simulated=(95.0, 83.0),
):
    """What the first page reads of an Analysis, with the faults asked for."""
    posterior = SimpleNamespace(
        converged=converged,
        problems=() if converged else ("too short",),
        summaries=SUMMARIES,
        names=tuple(SUMMARIES),
        point_estimate=[s.mean for s in SUMMARIES.values()],
        prior_dominated=dominated,
        conditional_on=given,
        power=power,
    )
    test = ResidualTest("white (Ljung-Box, 25 lags)", 1.0, 0.5, passed, "correlation in time is left")
    blocks = ("saturation.lower", "saturation.upper", "dead_zone")
    return SimpleNamespace(
        inference=SimpleNamespace(
            posterior=posterior,
            residuals=SimpleNamespace(
                tests=(test,),
                white=passed,
                explained=True,
                fit_percent=90.0,
                feedback=feedback,
                failures=() if passed else (f"{test.name}: {test.meaning}",),
            ),
        ),
        identification=SimpleNamespace(
            blocks_shown={b: SimpleNamespace(shown=b not in hidden, reason="flat") for b in blocks},
            fits=(SimpleNamespace(hammerstein_wiener=simulated[0], linear=simulated[1]),),
        ),
        predictions=(SimpleNamespace(fit_percent=94.5),),
        held_out=True,
        fits=(SimpleNamespace(hammerstein_wiener=94.5, linear=linear),),
        check=check,
        coverages=(("validation_1", Coverage(0.94, 0.93, (0.9, 0.96), 200.0)),),
    )


def test_estimates_in_one_sentence():
    assert verdict(analysis()).replace("\u00a0", " ") == (
        "The Hammerstein-Wiener model predicts a record it has not seen with a fit of 94.5 %, against 83.0 % "
        "of the best linear model. Saturation at −0.33560 ± 0.00030 and 0.44010 ± 0.00090 deg/s; "
        "dead zone of half width 0.00600 ± 0.00010 deg; resonances at 3.290 ± 0.010 and "
        "3.660 ± 0.020 Hz (mean ± standard deviation)."
    )


@pytest.mark.parametrize("fault", [{"hidden": ("dead_zone",)}, {"dominated": ("dead_zone.half_width",)}])
def test_block_not_shown_is_not_quoted(fault):
    found = analysis(**fault)
    text = verdict(found)
    assert "dead zone of half width" not in text
    assert text.endswith("Not shown by these records: dead-zone half width.")
    assert not_shown(found) == {"dead_zone.half_width"}
    assert badges(found)[3].state == "warn"


def test_faults_come_first_and_take_the_intervals_away():
    text = verdict(analysis(converged=False, passed=False, linear=95.8))
    assert text.startswith("The sampler has NOT converged")
    assert "Model and records disagree: correlation in time is left." in text
    assert "WORSE than 95.8\u00a0%" in text
    assert "±" not in text


def test_a_linear_model_of_the_same_fit_is_no_better():
    same = analysis().fits[0].hammerstein_wiener + 0.01
    assert ", as the best linear model does." in verdict(analysis(linear=same))


def test_a_refuted_model_says_so_on_the_first_card_and_quotes_no_number():
    found = analysis(passed=False)
    assert (badges(found)[0].label, badges(found)[0].state) == ("the model does not hold", "bad")
    assert "does not hold" in verdict(found) and "±" not in verdict(found) and "Hz" not in verdict(found)


def test_the_assumption_that_fails_is_named_where_a_linear_model_simulates_better():
    found = analysis(passed=False, simulated=(41.7, 95.9), power=0.02)
    text = verdict(found).replace("\u00a0", " ")
    assert "The assumption that fails is that the clipped command alone drives the axis" in text
    assert "95.9 % against 41.7 %" in text and "bayes-hw diagnose" in text
    assert "50 samples as one" in text
    usual = verdict(analysis(passed=False))
    assert "assumption" not in usual and "as one" not in usual
    assert "assumption" not in verdict(analysis(simulated=(41.7, 95.9)))


def test_what_the_intervals_are_given_is_a_warning():
    found = badges(analysis(given=("mode 2 at 3.66 Hz",)))
    assert found[1].state == "warn"
    assert (found[2].label, found[2].state) == ("conditional", "warn")
    assert "mode 2 at 3.66 Hz" in found[2].detail


def test_bands_of_one_record_are_never_a_failure():
    found = analysis()
    assert badges(found)[2].state == "good"
    found.coverages = (("v", replace(found.coverages[0][1], achieved=0.5, interval=(0.4, 0.6))),)
    badge = badges(found)[2]
    assert badge.state == "warn"
    assert badge.label == "bands hold 50.0\u00a0% of one record"


def test_intervals_hold_only_where_that_was_checked():
    """No badge without a check; green where chance alone explains what was missed; red where it does not."""

    def badge(check):
        return [b for b in badges(analysis(check=check)) if b.label.startswith("intervals")]

    assert badge(None) == []
    (good,) = badge(own_check(18, 20))
    assert (good.label, good.state) == ("intervals hold", "good") and "38 of 40" in good.detail
    (bad,) = badge(own_check(14, 20))
    assert (bad.label, bad.state) == ("intervals do not hold", "bad") and "dead-zone" in bad.detail
    (few,) = badge(own_check(4, 5))
    assert few.state == "warn" and "10 replicates" in few.detail


def test_a_closed_loop_is_said_on_the_first_page():
    assert "closed loop" in verdict(analysis(feedback=CLOSED))
    assert "closed loop" not in verdict(analysis())
