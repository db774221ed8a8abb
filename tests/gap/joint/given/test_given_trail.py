"""Where a search around a model stands: labels alone, and faults looked for until there are some."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, form, measured, model

from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_trail import Trail
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.response.joint_values import Effect

SAMPLES, BIAS = 400, 0.02


@pytest.fixture(scope="module")
def base() -> GivenFit:
    return best_base(measured((Effect(form("command_bias"), np.array([BIAS])),), SAMPLES, (1, 2)), model())


def test_what_a_label_alone_reaches_is_its_best_trial_from_the_base(base: GivenFit) -> None:
    begun = base.with_effect(form("command_bias"), (0.0,))
    biased = begun.descended()
    assert biased.score > base.score > begun.score
    trail = Trail.begun(base, read_faults(base), caused=False)
    for order in ([begun, biased], [biased, begun]):
        known = trail.knowing(order)
        assert known.rivals == {"command_bias": biased.score - base.score}
        assert known.alone["command_bias"] is biased
    beside = replace(trail, fit=biased)
    assert not beside.is_bare
    assert beside.knowing([begun, biased]).rivals == {}


def test_faults_of_the_readings_are_looked_for_until_there_are_some(base: GivenFit) -> None:
    """Glitches that no weights were given for yet weigh next to nothing from then on, in every fit."""
    plain, seen_anew = Trail.begun(base, read_faults(base), caused=False).with_faults()
    assert not seen_anew and not plain.readings.nats
    glitches = np.zeros(SAMPLES)
    glitches[40::80] = 30 * SIGMA
    records = [replace(r, y=r.y + glitches) for r in base.response.records]
    spoilt = best_base(records, model())
    trail, seen_anew = replace(Trail.begun(spoilt, plain.readings, caused=False), whole=spoilt).with_faults()
    assert seen_anew and "outliers" in trail.readings.nats
    for fit in (trail.fit, trail.base, trail.whole):
        assert fit.response.weights is trail.readings.weights
        assert fit.point.rms < 0.5 * spoilt.point.rms
    again, seen_anew = trail.with_faults()
    assert again is trail and not seen_anew
