"""Explanations of other samples around a given model: of those that lie clear of the dead zone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.search.effect_moves import slow_causes
from bayes_hw.gap.joint.search.hidden_zone import out_of_reach
from bayes_hw.gap.joint.search.verification import VERIFIED_BESIDE_NATS
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record


def on_records(fit: GivenFit, records: Sequence[Record]) -> GivenFit:
    """The same explanation of other records of the same samples, descended."""
    response = replace(fit.response, records=records)
    return GivenFit(response, evaluate(response, fit.point.coordinates)).descended()


def away_from_zero(fit: GivenFit, base: GivenFit) -> GivenFit | None:
    """The base on what lies clear of the dead zone, however the slow error that `fit` leaves shifts the axis:
    there a shift shows whole. None where that is all or little of the records."""
    clear = out_of_reach(fit, fit.response.records)
    return None if clear is None else on_records(base, clear)


def slow_clear_of_zone(fit: GivenFit, base: GivenFit, slow: Sequence[GivenFit]) -> GivenFit | None:
    """The base clear of the dead zone where one of the causes that are `slow` explains more than `fit` does:
    on all samples the steps of a slow error at the zone's edges may be explained by an effect."""
    clear = away_from_zero(highest(slow), base)
    if clear is None:
        return None
    caused = slow_causes(clear)
    lead = max((one.score for one in caused), default=-np.inf) - on_records(fit, clear.response.records).score
    return clear if lead > 0 else None


def slow_beside(fit: GivenFit) -> tuple[GivenFit, list[GivenFit]]:
    """The fit on the records clear of the dead zone, or on all of them where it hides nothing, and the causes
    of the noise beside its labels there; the fit as it is and none unless one of them explains as much more
    than noise without a name as such a cause must beside a label."""
    slow = slow_causes(fit)
    if not slow:
        return fit, []
    there = on_records(fit, out_of_reach(highest(slow), fit.response.records) or fit.response.records)
    slow = slow_causes(there)
    enough = highest([there, *slow]).score > there.score + VERIFIED_BESIDE_NATS
    return (there, slow) if enough else (fit, [])
