"""From nats and spectra to answers: each rule on numbers of its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS
from bayes_hw.gap.joint.joint_calibration import JointCalibration
from bayes_hw.gap.joint.joint_decision import JointDecision, decide, decide_jointly
from bayes_hw.gap.joint.joint_evidence import JointEvidence
from bayes_hw.gap.joint.joint_search import JointAnswer
from bayes_hw.gap.joint.noise_causes import NoiseSpectrum
from bayes_hw.gap.joint.remainder import Remainder

QUIET = NoiseSpectrum(0.0, 0.0, -4.0, -4.0, -11.0, 0.1)


def _decided(
    nats: dict[str, float],
    spectrum: NoiseSpectrum = QUIET,
    *,
    readings: dict[str, float] | None = None,
    rivals: dict[str, float] | None = None,
    kurtosis: float = 0.0,
    followed: tuple[str, ...] = (),
) -> JointDecision:
    order = 0 if spectrum is QUIET else 8
    found = SimpleNamespace(
        nats=nats,
        readings=SimpleNamespace(nats=readings or {}),
        rivals=rivals or dict.fromkeys(LABEL_BLOCKS, -14.0),
        remainder=Remainder(order, 1.0 if order == 0 else 2.0, kurtosis, spectrum),
        fit=SimpleNamespace(labels=tuple(nats), score=sum(nats.values())),
        base=SimpleNamespace(score=0.0),
        followed=followed,
    )
    return decide_jointly(cast(JointAnswer, found))


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


@pytest.mark.parametrize(
    ("spectrum", "kurtosis", "answer"),
    [
        (NoiseSpectrum(0.0, 2322.0, 2126.0, 2091.0, 2378.0, 0.5), 0.1, ("wind",)),
        (NoiseSpectrum(0.0, 900.0, 700.0, 950.0, 942.0, 0.0), 0.1, ("sensor_drift",)),
        (NoiseSpectrum(0.0, 2867.0, 2029.0, 2931.0, 2938.0, 0.0), 1.3, ("other",)),
        (NoiseSpectrum(0.0, 3606.0, 2690.0, 2764.0, 3085.0, 0.4), 0.2, ("other",)),
        (NoiseSpectrum(0.0, 1720.0, 1718.0, 1551.0, 1710.0, 0.7), 0.0, ()),
    ],
)
def test_noise_that_is_left_has_a_cause(
    spectrum: NoiseSpectrum, kurtosis: float, answer: tuple[str, ...]
) -> None:
    """Wind, an angle that walks, jumps, a line, and plain coloured noise."""
    assert _decided({}, spectrum, kurtosis=kurtosis).answer == answer


def test_a_rival_as_good_is_stated() -> None:
    found = _decided({"encoder_eccentricity": 250.0}, rivals={"torque_ripple": 245.0})
    assert found.confusable == (("encoder_eccentricity", "torque_ripple"),)
    assert found.probability["torque_ripple"] > 0.3


@pytest.mark.parametrize("rival", ["backlash", "other"])
def test_a_rival_followed_to_the_end_has_its_share_by_nats(rival: str) -> None:
    """However far it falls behind, and whether it has a name or not; one that is near is confusable."""
    between = JointCalibration.built_in().nats_between
    for lead in (5.0, 100.0):
        rivals = {"friction": 900.0, rival: 900.0 - lead}
        found = _decided({"friction": 900.0}, rivals=rivals, followed=("friction", rival))
        odds = found.probability["friction"] / found.probability[rival]
        assert odds == pytest.approx(np.exp(lead / between))
        assert found.confusable == ((("friction", rival),) if lead == 5.0 else ())


def test_readings_and_a_law_without_a_name() -> None:
    assert _decided({}, readings={"outliers": 500.0}).answer == ("outliers",)
    assert _decided({"other": 300.0}).answer == ("other",)
    assert _decided({"gain_drift": 300.0, "other": 100.0}).answer == ("gain_drift", "other")


def test_what_the_readings_show_comes_first() -> None:
    found = _decided(
        {"torque_ripple": 2450.0, "encoder_eccentricity": 1680.0}, readings={"encoder_quantization": 860.0}
    )
    assert found.answer == ("encoder_quantization", "torque_ripple")


def test_a_rhythm_of_samples_has_no_name() -> None:
    quiet = Remainder(0, 1.0, 0.2, QUIET, 90.0)
    found = decide(JointEvidence({}, {}, {}, 0.0, (), quiet))
    assert found.answer == ("other",)
    late = decide(JointEvidence({}, {"timing_jitter": 600.0}, {}, 0.0, (), quiet))
    assert late.answer == ("other",)
    assert decide(JointEvidence.from_dict(JointEvidence({}, {}, {}, 0.0, (), quiet).to_dict())) == found


def test_wind_and_a_walk_of_one_spectrum_are_not_told_apart() -> None:
    """Nor is either stated as sure; where one spectrum is clearly better it is."""
    near = _decided({}, NoiseSpectrum(0.0, 1200.0, 1118.0, 1296.0, 1289.0, 0.01))
    assert near.answer == ("sensor_drift",)
    assert near.confusable == (("sensor_drift", "wind"),)
    assert near.probability["sensor_drift"] < 0.7 and near.probability["wind"] > 0.2
    clear = _decided({}, NoiseSpectrum(0.0, 2322.0, 2126.0, 2091.0, 2378.0, 0.5))
    assert clear.answer == ("wind",) and clear.confusable == () and clear.probability["wind"] > 0.9
