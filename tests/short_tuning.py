"""A search for the settings of a controller over few of them: for tests of what is made of a tuned one."""

from __future__ import annotations

import pytest

from bayes_hw.control import tuning


def tune_shortly(patch: pytest.MonkeyPatch) -> None:
    """Less than half of the gains, two integral ratios, one derivative time."""
    patch.setattr(tuning, "GAIN_POINTS", 8)
    patch.setattr(tuning, "GAIN_BISECTIONS", 3)
    patch.setattr(tuning, "INTEGRAL_RATIOS", (4.0, 7.0))
    patch.setattr(tuning, "DERIVATIVE_PERIODS", (1.5,))
