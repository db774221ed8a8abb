"""What comes before sampling, cut short: for tests of what a command or a page makes of a posterior."""

from __future__ import annotations

import pytest

from bayes_hw.identify import several_starts
from bayes_hw.infer import pilot


def sample_shortly(patch: pytest.MonkeyPatch) -> None:
    """A pilot of a third of its steps and a quarter of its proposals, from three starts of the twelve."""
    patch.setattr(pilot, "PILOT_STEPS", 30)
    patch.setattr(pilot, "TRIAL_PROPOSALS", 512)
    defaults = several_starts.fit_from_several_starts.__kwdefaults__
    assert defaults is not None
    patch.setitem(defaults, "starts", 3)
