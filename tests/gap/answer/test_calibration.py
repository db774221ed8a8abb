"""The constants of the decision."""

from __future__ import annotations

import pytest

from bayes_hw.gap.answer.calibration import Calibration


def test_a_pair_must_gain_more_than_a_single_label_and_nothing_nothing() -> None:
    calibration = Calibration.built_in()
    assert calibration.handicap(()) == 0.0
    assert calibration.handicap(("friction",)) == pytest.approx(calibration.single_gain)
    both = calibration.single_gain + calibration.pair_gain
    assert calibration.handicap(("friction", "wind")) == pytest.approx(both)


def test_posteriors_may_be_taken_as_they_are() -> None:
    plain = Calibration.built_in().with_posteriors_as_they_are()
    assert plain.astray_share == 0.0 and plain.floor == Calibration.built_in().floor
