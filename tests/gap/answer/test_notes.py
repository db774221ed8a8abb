"""Notes beside the verdict: what the best explanation would need that no effect of its kind has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from drive_axis import SIGMA, white
from fitted import SAMPLES, base, with_residuals

from bayes_hw.gap.answer.notes import of_the_unheard_of
from bayes_hw.gap.effects.linear import UnmodelledMode
from bayes_hw.gap.fit.explanation import Explanation


def test_what_an_effect_would_need_is_said_with_its_amount() -> None:
    """Nothing of one that is as such effects are."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    hypothesis = base(records=1).with_effect(UnmodelledMode())
    usual = hypothesis.to_values(hypothesis.prior_means)
    for damping_ratio, said in ((0.02, []), (1.2, ["a damping ratio of 1.2"])):
        values = np.append(usual[:-1], damping_ratio)
        moved = replace(fit, hypothesis=hypothesis, coordinates=hypothesis.to_coordinates(values))
        notes = of_the_unheard_of(Explanation(moved, None, 0.0))
        assert len(notes) == bool(said)
        assert all(word in notes[0] for word in said)
