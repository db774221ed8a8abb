"""The cascade that the joint search begins at is not one whose noise took up what the axis does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from joint_axis import SIGMA, STRUCTURE, measured

from bayes_hw.gap.joint.fit import base_cascade
from bayes_hw.gap.joint.fit.base_cascade import grown_base
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.growth.search import Grown, smallest_cascade
from bayes_hw.record import Record


@pytest.mark.parametrize("hides", [True, False])
def test_where_noise_hides_a_misfit_a_cascade_on_plain_residuals_goes_on(
    hides: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The growth under coloured noise made to stop at an integrator: it is left where its noise is too large
    for its innovations, and stays where that is not so."""
    records, grown = measured((), 1200, (1, 2)), base_cascade._grown

    def stopped(r: Sequence[Record], structure: Structure, level: float, most_noise: int) -> Grown:
        if most_noise:
            return smallest_cascade(r, structure, level, most_noise).descended()
        return grown(r, structure, level, most_noise)

    smallest = replace(STRUCTURE, sections=0, delay_samples=0)
    poor = stopped(records, smallest, SIGMA, 12)
    assert poor.structure.order < STRUCTURE.order
    monkeypatch.setattr(base_cascade, "_grown", stopped)
    monkeypatch.setattr(base_cascade, "absorbed", lambda _: hides)
    base = grown_base(records, SIGMA)
    assert (base.point.rms < 1.1 * SIGMA) == hides
    assert (base.structure.order >= STRUCTURE.order) == hides
