"""The report on the next experiment names settings in words."""

from __future__ import annotations

from bayes_hw.identifiability.excitation_families import Circumstances, families
from bayes_hw.identifiability.motion_limits import MotionLimits
from bayes_hw.model.blocks import Saturation
from bayes_hw.report.page.names import setting_words

CIRCUMSTANCES = Circumstances(20.0, 30.0, MotionLimits(1.0, 10.0, -1.0, 1.0), Saturation(-0.8, 1.0))


def test_every_setting_has_words() -> None:
    for family in families(CIRCUMSTANCES):
        for setting in family.settings:
            assert "_" not in setting_words(setting.name)
