"""From nats to answers: each rule on numbers of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from bayes_hw.files import read_json, write_json
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.decision.given_decision import GivenCalibration
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import JointDecision, JointEvidence, decide, decide_jointly
from bayes_hw.gap.joint.residuals.remainder import COLOURED_NATS, Remainder
from bayes_hw.gap.joint.search.joint_search import JointAnswer


def _decided(
    nats: dict[str, float],
    *,
    coloured: float = 0.0,
    readings: dict[str, float] | None = None,
    rivals: dict[str, float] | None = None,
    followed: tuple[str, ...] = (),
    stand_ins: dict[str, dict[str, float]] | None = None,
) -> JointDecision:
    found = SimpleNamespace(
        nats=nats,
        readings=SimpleNamespace(nats=readings or {}),
        rivals=rivals or dict.fromkeys(LABEL_BLOCKS, -14.0),
        remainder=Remainder(8 if coloured else 0, coloured),
        fit=SimpleNamespace(labels=tuple(nats), score=sum(nats.values())),
        base=SimpleNamespace(score=0.0),
        cut_short=False,
        followed=followed,
        stand_ins=stand_ins or {},
        follows_no_better=False,
    )
    return decide_jointly(cast(JointAnswer, found))


def test_noise_that_knows_the_command_is_no_wind() -> None:
    found = JointEvidence(
        {"wind": 300.0, "friction": 900.0}, {}, {}, 1200.0, ("wind", "friction"), Remainder(1, 0)
    )
    assert decide(found).answer == ("friction", "wind")
    changed = decide(replace(found, remainder=replace(found.remainder, commanded=60.0)))
    assert changed.answer == ("friction", "other")
    alone = replace(found, nats={"wind": 300.0}, labels=("wind",), remainder=Remainder(1, 0, commanded=60.0))
    assert decide(alone).answer == ("other",)
    pulses = JointCalibration.built_in().nats_refuting + 0.1
    refuted = replace(alone, remainder=Remainder(1, 0, refuted=pulses))
    assert decide(refuted).answer == ("other",)
    assert decide(replace(alone, remainder=Remainder(1, 0, refuted=pulses - 0.2))).answer == ("wind",)


def test_a_staircase_knows_the_command_and_is_no_gap_of_its_own() -> None:
    """What rounding leaves is slow where the axis is: no wind, and nothing else either."""
    left = Remainder(1, 0.0, commanded=17.0, refuted=10.0)
    slow = JointEvidence({"wind": 35.0}, {"encoder_quantization": 900.0}, {}, 35.0, ("wind",), left)
    assert decide(slow).answer == ("encoder_quantization",)
    assert decide(replace(slow, reading_nats={"outliers": 900.0})).answer == ("outliers", "other")
    wind = replace(slow, remainder=Remainder(1, 0.0))
    assert decide(wind).answer == ("encoder_quantization", "wind")


def test_colour_casts_doubt_by_how_nearly_it_counts_as_a_cause() -> None:
    """An order above one that chance would choose hides nothing; from COLOURED_NATS on all of the doubt."""
    of_friction = [
        _decided({"friction": 2800.0}, coloured=nats).probability["friction"]
        for nats in (0.0, 0.5, 20.0, COLOURED_NATS, 900.0)
    ]
    assert of_friction[0] == pytest.approx(of_friction[1], abs=0.01)
    assert of_friction[0] > of_friction[2] > of_friction[3] == of_friction[4]


def test_nothing_left_is_no_gap() -> None:
    found = _decided({})
    assert found.answer == ()
    assert found.probability["none"] > 0.8
    assert set(found.probability) == {*LABEL_BLOCKS, "none", "other"}


def test_many_nats_are_nearly_sure_and_few_are_not() -> None:
    floor = JointCalibration.built_in().floor
    assert _decided({"friction": 900.0}).probability["friction"] == pytest.approx(1 - floor)
    assert floor < 0.05
    few = _decided({"friction": 30.0})
    assert few.answer == ("friction",)
    assert 0.5 < few.probability["friction"] < 0.8


def test_a_search_cut_short_is_less_sure_of_what_it_named() -> None:
    """Not of what the readings themselves show."""
    quiet = Remainder(0, 0.0)
    found = JointEvidence({"friction": 900.0}, {"outliers": 900.0}, {}, 900.0, ("friction",), quiet)
    cut = replace(found, cut_short=True)
    assert JointEvidence.from_dict(cut.to_dict()) == cut
    whole, less = decide(found).probability, decide(cut).probability
    assert less["friction"] <= 0.7 < 0.9 < whole["friction"]
    assert less["outliers"] == whole["outliers"]
    assert decide(cut).answer == decide(found).answer


@pytest.mark.parametrize("calibration", [JointCalibration.built_in(), GivenCalibration.built_in()])
def test_a_search_cut_short_is_not_sure_that_nothing_is_there(calibration: JointCalibration) -> None:
    """Nor, around a given model, of what it named."""
    found = JointEvidence({}, {}, {}, 0.0, (), Remainder(0, 0.0))
    whole, less = (decide(one, calibration).probability for one in (found, replace(found, cut_short=True)))
    assert less["none"] <= 0.7 < 0.9 < whole["none"]
    assert sum(less.values()) == pytest.approx(1.0)
    assert less["other"] > whole["other"]
    named = replace(found, nats={"friction": 2000.0}, labels=("friction",), own=2000.0, cut_short=True)
    assert decide(named, calibration).probability["friction"] <= 0.7


def test_colour_that_nothing_explains_has_no_name() -> None:
    """None of a label is left; what is little, or is what rounding leaves, says nothing."""
    assert _decided({}, coloured=900.0).answer == ("other",)
    assert _decided({}, coloured=20.0).answer == ()
    assert _decided({"friction": 900.0}, coloured=900.0).answer == ("friction",)
    assert _decided({}, coloured=900.0, readings={"outliers": 1500.0}).answer == ("outliers", "other")
    rounded = _decided({}, coloured=900.0, readings={"encoder_quantization": 500.0})
    assert rounded.answer == ("encoder_quantization",)
    assert _decided({}, coloured=30.0, readings={"timing_jitter": 80.0}).answer == ("timing_jitter",)
    assert _decided({}, coloured=900.0, readings={"timing_jitter": 80.0}).answer == ("other",)


def test_what_mends_a_form_without_a_name_is_no_effect_of_its_own() -> None:
    assert _decided({"other": 2600.0, "torque_ripple": 600.0}).answer == ("torque_ripple", "other")
    found = _decided({"other": 2600.0, "torque_ripple": 130.0})
    assert found.answer == ("other",)
    assert found.probability["torque_ripple"] <= JointCalibration.built_in().beside_other


@pytest.mark.parametrize("calibration", [JointCalibration.built_in(), GivenCalibration.built_in()])
def test_beside_much_that_is_left_a_label_is_held_against_all_that_may_stand_in_the_place_of_other(
    calibration: JointCalibration,
) -> None:
    """Rivals of what has no name take their share of it, and make the label beside it no more certain."""
    rivals = {"other": 700.0, "backlash": 699.0, "friction": 699.0}
    nats = {"other": 600.0, "cubic_stiffness": 600.0}
    labels = ("other", "cubic_stiffness")
    found = JointEvidence(nats, {}, rivals, 700.0, labels, Remainder(1, 0.0), tuple(rivals))
    assert decide(found, calibration).answer == ("cubic_stiffness", "other")
    left = replace(found, remainder=Remainder(11, 10 * COLOURED_NATS))
    stated = decide(left, calibration)
    assert stated.answer == ("other",)
    assert stated.probability["cubic_stiffness"] <= calibration.beside_other


def test_a_rival_as_good_is_stated() -> None:
    found = _decided({"encoder_eccentricity": 250.0}, rivals={"torque_ripple": 245.0})
    assert found.confusable == (("encoder_eccentricity", "torque_ripple"),)
    assert found.probability["torque_ripple"] > 0.3


@pytest.mark.parametrize("answer", ["other", "friction"])
def test_a_rival_that_did_not_stand_takes_no_probability(answer: str) -> None:
    """One that leads by far and is not among the ends was refuted: an answer is what is most probable."""
    for lead, near in ((156.0, False), (3.0, True)):
        own, rivals = 1691.0, {answer: 1691.0, "backlash": 1691.0 + lead}
        found = _decided({answer: own}, rivals=rivals, followed=(answer,))
        assert found.answer == (answer,)
        assert (found.probability["backlash"] > found.probability[answer]) is near
        assert (found.probability["backlash"] > 0.4) is near


@pytest.mark.parametrize("rival", ["backlash", "other"])
def test_a_rival_followed_to_the_end_has_its_share_by_nats(rival: str) -> None:
    """However far it falls behind, and whether it has a name or not; one that is near is confusable."""
    constants = JointCalibration.built_in()
    for lead, own in ((5.0, 900.0), (100.0, 900.0), (100.0, 1800.0)):
        rivals = {"friction": own, rival: own - lead}
        found = _decided({"friction": own}, rivals=rivals, followed=("friction", rival))
        odds = found.probability["friction"] / found.probability[rival]
        between = constants.nats_between + constants.share_between * own
        assert odds == pytest.approx(np.exp(lead / between))
        assert found.confusable == ((("friction", rival),) if lead == 5.0 else ())


def test_what_has_no_name_is_no_rival_of_itself() -> None:
    """A shape of any form is followed to the end, and stands in the fit under no label."""
    left = Remainder(0, 0.0)
    found = JointEvidence({"other": 900.0}, {}, {"other": 900.0}, 900.0, (), left, ("other",))
    assert decide(found).answer == ("other",)
    assert decide(found).confusable == ()


def test_several_rivals_share_by_their_nats_whatever_their_order() -> None:
    """Four labels equally good have equal probabilities, and the answer is no less likely than a rival."""
    equal = dict.fromkeys(("sensor_drift", "gain_drift", "command_bias"), 250.0)
    found = _decided({"gain_asymmetry": 250.0}, rivals=equal)
    shares = [found.probability[label] for label in ("gain_asymmetry", *equal)]
    np.testing.assert_allclose(shares, shares[0])
    behind = {label: 250.0 - 4 * i for i, label in enumerate(equal)}
    turned = dict(reversed(behind.items()))
    first, second = (_decided({"gain_asymmetry": 252.0}, rivals=r).probability for r in (behind, turned))
    assert first == pytest.approx(second)
    assert first["gain_asymmetry"] == max(first.values())


def test_a_rival_near_in_nats_and_unlikely_is_not_confusable() -> None:
    wide = replace(JointCalibration.built_in(), nats_as_good=1e6)
    told = {"friction": 900.0}, {}, {"friction": 900.0, "backlash": 400.0}, 900.0, ("friction",)
    found = decide(JointEvidence(*told, Remainder(0, 0.0), ("friction", "backlash")), wide)
    assert found.probability["backlash"] < 0.05 * found.probability["friction"]
    assert found.confusable == ()


def test_the_doubt_of_a_weak_label_goes_to_other_and_to_the_rest() -> None:
    constants, nats = JointCalibration.built_in(), 12.0
    found = _decided({"friction": nats})
    doubt = 1 - constants.sure(nats, constants.floor)
    elsewhere = doubt - constants.nothing([nats])
    assert doubt > constants.floor and elsewhere > 0.05
    assert found.probability["friction"] == pytest.approx(1 - doubt)
    assert found.probability["other"] == pytest.approx(constants.others_share * elsewhere)
    silent = [p for label, p in found.probability.items() if label not in ("friction", "other", "none")]
    assert sum(silent) == pytest.approx((1 - constants.others_share) * elsewhere)


def test_a_name_that_was_not_followed_has_its_share_of_what_has_none() -> None:
    constants = JointCalibration.built_in()
    rival = constants.near * 900.0 + 1
    assert 900.0 - rival > constants.nats_as_good
    found = _decided({"other": 900.0}, rivals={"backlash": rival})
    whole = constants.sure(900.0, constants.other_floor)
    assert found.answer == ("other",)
    assert found.probability["other"] == pytest.approx((1 - constants.named_share) * whole)
    assert found.probability["backlash"] == pytest.approx(
        min(constants.named_share * whole, constants.beside_other)
    )


def test_what_is_as_good_in_the_place_of_one_of_two_shares_with_that_one() -> None:
    """A drift as good as a bias beside limits that move; what falls behind, or is in the answer, is none."""
    nats = {"saturation_drift": 300.0, "command_bias": 250.0}
    plain = _decided(nats)
    leads = {"command_bias": {"sensor_drift": 0.0, "gain_drift": 90.0, "saturation_drift": 0.0}}
    found = _decided(nats, stand_ins=leads)
    assert found.answer == plain.answer
    assert found.confusable == (("command_bias", "sensor_drift"),)
    assert found.probability["sensor_drift"] == pytest.approx(found.probability["command_bias"])
    together = [sum(d.probability[x] for x in ("command_bias", "sensor_drift")) for d in (plain, found)]
    assert together[0] == pytest.approx(together[1])
    assert found.probability["saturation_drift"] == plain.probability["saturation_drift"]


def test_a_label_and_its_rival_are_together_no_more_than_sure() -> None:
    """The doubt of a weak second label goes to `other` in part, which is the first one's rival as well."""
    nats, rivals = {"wind": 30.0, "rate_limit": 900.0}, {"rate_limit": 900.0, "other": 700.0}
    found = _decided(nats, rivals=rivals, followed=("rate_limit", "other"))
    assert set(found.answer) == {"rate_limit", "wind"}
    assert found.probability["rate_limit"] + found.probability["other"] <= 1.0


def test_readings_and_a_law_without_a_name() -> None:
    assert _decided({}, readings={"outliers": 500.0}).answer == ("outliers",)
    assert _decided({"other": 300.0}).answer == ("other",)
    assert _decided({"gain_drift": 300.0, "other": 100.0}).answer == ("gain_drift", "other")


def test_what_the_readings_show_comes_first() -> None:
    found = _decided(
        {"torque_ripple": 2450.0, "encoder_eccentricity": 1680.0}, readings={"encoder_quantization": 860.0}
    )
    assert found.answer == ("encoder_quantization", "torque_ripple")


def test_a_law_that_only_corrections_keep_on_the_records_has_no_name() -> None:
    """Glitches of the readings stay."""
    quiet = Remainder(0, 0.0)
    told = {"friction": 900.0}, {"outliers": 950.0}, {"friction": 900.0}, 900.0, ("friction",), quiet
    assert decide(JointEvidence(*told)).answer == ("outliers", "friction")
    lost = JointEvidence(*told, follows_no_better=True)
    assert decide(lost).answer == ("outliers", "other")
    assert decide(lost).probability["friction"] < 0.5 < decide(lost).probability["other"]
    assert JointEvidence.from_dict(lost.to_dict()) == lost


def test_what_is_wrong_with_readings_may_have_no_name() -> None:
    """It stands beside what the readings show besides, and beside an effect that is worth more."""
    quiet = Remainder(0, 0.0)
    found = decide(JointEvidence({}, {"other": 90.0}, {}, 0.0, (), quiet))
    assert found.answer == ("other",)
    rounded = {"encoder_quantization": 600.0, "other": 90.0}
    assert decide(JointEvidence({}, rounded, {}, 0.0, (), quiet)).answer == ("encoder_quantization", "other")
    for nats, expected in ((600.0, ("friction", "other")), (60.0, ("other",))):
        told = {"friction": nats}, {"other": 90.0}, {"friction": nats}, nats, ("friction",), quiet
        assert decide(JointEvidence(*told)).answer == expected
    beside = {"other": 500.0, "friction": 300.0}
    told = beside, {"other": 90.0}, {"friction": 300.0}, 800.0, ("other", "friction"), quiet
    assert decide(JointEvidence(*told)).answer == decide(JointEvidence(beside, {}, *told[2:])).answer


@pytest.mark.parametrize("beside", [{}, {"saturation_drift": 300.0}], ids=["alone", "beside"])
def test_wind_and_a_walk_nearly_as_likely_are_not_told_apart(beside: dict[str, float]) -> None:
    """Nor is either stated as sure, and no other label for it; where one is clearly likelier it is stated."""
    nats = {**beside, "wind": 400.0}
    own = sum(nats.values())
    for lead in (5.0, 120.0):
        rivals = {"wind": own, "sensor_drift": own - lead} | dict.fromkeys(beside, own)
        found = _decided(nats, rivals=rivals, followed=tuple(rivals))
        assert set(found.answer) == set(nats)
        assert found.confusable == ((("wind", "sensor_drift"),) if lead == 5.0 else ())
        assert (found.probability["wind"] > 0.9) == (lead > 100)
        assert (found.probability["sensor_drift"] > 0.1) == (lead < 100)
        assert all(found.probability[label] > 0.9 for label in beside)


def test_no_gap_beside_labels_is_the_product_of_their_doubts() -> None:
    constants = JointCalibration.built_in()
    expected = [constants.doubt * np.exp(-nats / constants.nats_of_gap) for nats in (5.0, 20.0)]
    assert constants.nothing([5.0, 20.0]) == pytest.approx(expected[0] * expected[1])
    assert constants.nothing([]) == 1.0
    assert constants.nothing([-3.0]) == pytest.approx(constants.doubt)


def test_only_what_is_more_certain_than_other_stands_beside_it() -> None:
    """The same nats, of a search that came to its end and of one that was cut short."""
    told = {"friction": 900.0}, {"other": 600.0}, {"friction": 900.0}, 900.0, ("friction",), Remainder(0, 0.0)
    whole, cut = (decide(JointEvidence(*told, cut_short=short)) for short in (False, True))
    assert whole.answer == ("friction", "other")
    assert whole.probability["friction"] >= whole.probability["other"]
    assert cut.answer == ("other",)
    assert cut.probability["friction"] < 0.5 < cut.probability["other"]


def test_what_cannot_be_simulated_without_a_label_goes_through_a_file(tmp_path: Path) -> None:
    found = JointEvidence(
        {"friction": np.inf},
        {},
        {"friction": np.inf, "backlash": -np.inf},
        np.inf,
        ("friction",),
        Remainder(0, 0),
        stand_ins={"friction": {"backlash": np.inf}},
    )
    write_json(tmp_path / "evidence.json", found.to_dict())
    read = JointEvidence.from_dict(read_json(tmp_path / "evidence.json"))
    assert decide(read) == decide(found)
    assert decide(read).answer == ("friction",)
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "evidence.json", replace(found, own=np.nan).to_dict())
