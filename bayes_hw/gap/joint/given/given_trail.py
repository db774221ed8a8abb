"""Where a search around a given model stands, and what it may do there but look for one more label."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.gap.joint.given.clear_of_zone import (
    away_from_zero,
    on_records,
    slow_beside,
    slow_clear_of_zone,
)
from bayes_hw.gap.joint.given.given_base import reweighted
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_verification import is_too_small
from bayes_hw.gap.joint.residuals.readings import Readings, read_faults
from bayes_hw.gap.joint.residuals.rounded_readings import without_rounding
from bayes_hw.gap.joint.search.effect_moves import slow_causes
from bayes_hw.record import Record


@dataclass(frozen=True, eq=False)
class Trail:
    """The fit, the base and the readings under the present weights, what every label alone reached and by
    which fit; `whole` is the base of all samples, `caused` whether noise may have a cause beside labels."""

    fit: GivenFit
    base: GivenFit
    whole: GivenFit
    readings: Readings
    rivals: Mapping[str, float]
    alone: Mapping[str, GivenFit]
    caused: bool = False

    @classmethod
    def begun(cls, base: GivenFit, readings: Readings, *, caused: bool) -> Trail:
        """Without a label."""
        return cls(base, base, base, readings, {}, {}, caused)

    @property
    def is_bare(self) -> bool:
        """Whether it has not found anything yet."""
        return self.fit is self.base

    @property
    def records(self) -> Sequence[Record]:
        """What the fit explains."""
        return self.base.response.records

    def with_slow_causes(self, say: Callable[[str], None]) -> tuple[Trail, list[GivenFit]]:
        """The causes that the noise may have: of a label that was found without, those that explain enough
        beside it, clear of the dead zone from then on."""
        if self.caused or self.is_bare:
            return self, slow_causes(self.fit) if self.caused else []
        fit, slow = slow_beside(self.fit)
        if not slow:
            return self, []
        say("noise of a cause explains what is left")
        there = fit.response.records
        base = on_records(self.base, there)
        alone = {label: on_records(one, there) for label, one in self.alone.items()}
        rivals = {label: one.score - base.score for label, one in alone.items()}
        return replace(self, fit=fit, base=base, alone=alone, rivals=rivals, caused=True), slow

    def knowing(self, trials: Sequence[GivenFit]) -> Trail:
        """With what labels alone reach among trials from the base."""
        if not self.is_bare:
            return self
        rivals, alone = dict(self.rivals), dict(self.alone)
        for t in (t for t in trials if len(set(t.labels)) == 1):
            label = t.labels[0]
            if t.score - self.base.score > rivals.get(label, -np.inf):
                rivals[label], alone[label] = t.score - self.base.score, t
        return replace(self, rivals=rivals, alone=alone)

    def clear_of_zone(self, best: GivenFit, instead: Sequence[GivenFit] | None) -> Trail | None:
        """Begun again on what lies clear of the dead zone, where the `best` next step is noise of a cause, or
        causes that the base may have `instead` explain more there; None elsewhere."""
        clear = None
        if self.base is self.whole and best.response.cause is not None and not is_too_small(best):
            clear = away_from_zero(best, self.base)
        elif self.base is self.whole and self.is_bare and instead and best.noise_order > 1:
            clear = slow_clear_of_zone(best, self.base, instead)
        return None if clear is None else Trail(clear, clear, self.whole, self.readings, {}, {}, caused=True)

    def with_faults(self) -> tuple[Trail, bool]:
        """Under the weights that faults of the readings ask for, if there are any that were not seen before;
        whether there are."""
        if self.readings.nats:
            return self, False
        faults = read_faults(self.fit)
        if not faults.nats:
            return self, False
        base, fit, whole, faults = under(faults, self.base, self.fit, self.whole)
        return replace(self, fit=fit, base=base, whole=whole, readings=faults), True


def under(
    faults: Readings, base: GivenFit, fit: GivenFit, whole: GivenFit
) -> tuple[GivenFit, GivenFit, GivenFit, Readings]:
    """The fits under what the readings' faults ask for, and the faults as they are then."""
    all_samples = base.response.records is whole.response.records
    base, fit = reweighted(base, faults), reweighted(fit, faults)
    if faults.rounded_first and all_samples:
        fit, faults = without_rounding(fit, faults)
        base = on_records(base, fit.response.records)
    return base, fit, base if all_samples else reweighted(whole, faults), faults
