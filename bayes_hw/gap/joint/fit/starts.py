"""How the predictions of all records held out begin: in motion, from rest, or after a lead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.moving_start import MovingStart
from bayes_hw.gap.joint.fit.unreached_limits import beyond_records
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.levels import level_shapes, levels_of
from bayes_hw.identify.holes import with_holes
from bayes_hw.posing import Start
from bayes_hw.record import Record
from bayes_hw.record_start import begins_in_motion

EVIDENCE_NATS = 20.0
"""What the steps must earn beyond half of Schwarz's price, to be more than what a model lacks at a start."""


@dataclass(frozen=True, eq=False)
class Starts:
    """How the predictions of records begin: those of `moving` from the state that fits their beginning, all
    others from rest, of which the first `lead` samples are not scored."""

    moving: tuple[MovingStart, ...] = ()
    lead: int = 0

    @classmethod
    def of(
        cls,
        fit: JointFit,
        train: Sequence[Record],
        holdout: Sequence[Record],
        lead: int = 0,
        start: Start = "auto",
        told_by: Sequence[Record] | None = None,
    ) -> Starts:
        """Which of `holdout` begin in motion: told by the angle itself, or by the fitted model.

        With `start` "rest" none does, with "free" all do. A `lead` comes from rest. The model is held against
        `told_by`, the same records less what it does not explain.
        """
        if lead or start == "rest":
            return cls(lead=lead)
        asked: float | None = None
        found = []
        for record, seen in zip(holdout, told_by or holdout, strict=True):
            moves = start == "free" or begins_in_motion(record.u, record.y, record.sample_rate_hz)
            if not moves:
                nats = MovingStart.of(seen, fit, train).nats(fit)
                if nats > EVIDENCE_NATS and asked is None:
                    asked = EVIDENCE_NATS + nats_at_rest(fit)
                moves = nats > (EVIDENCE_NATS if asked is None else asked)
            if moves:
                found.append(MovingStart.of(record, fit, train))
        return cls(tuple(found))

    @cached_property
    def _by_record(self) -> dict[int, MovingStart]:
        return {id(one.record): one for one in self.moving}

    def levelled(self, record: Record, fit: JointFit) -> Record:
        """A record held out that begins at rest with angles that count from where the fit says, by all of its
        samples, where its own first ones are all that told its level; any other as it is."""
        if id(record) in self._by_record or not record.has_free_level:
            return record
        e = with_holes(record.y - self.predict(fit, record), record.measured)
        masks = None if record.measured is None else [record.measured]
        (level,) = levels_of([e], level_shapes([record]), fit.point.whitener, masks)
        return record.counted_from(float(level))

    def unscored(self, record: Record) -> int:
        """How many of the first samples of a record held out do not count."""
        moving = self._by_record.get(id(record))
        return self.lead if moving is None else moving.samples

    def predict(
        self,
        fit: JointFit,
        record: Record,
        values: JointValues | None = None,
        rng: np.random.Generator | None = None,
    ) -> FloatArray:
        """Angles (samples,) of a record; `values` and `rng` as in `MovingStart.predict`."""
        moving = self._by_record.get(id(record))
        if moving is not None:
            return moving.predict(fit, values, rng)
        own = beyond_records(fit, fit.values if values is None else values, record.u, rng)
        return fit.response.simulate(own, record.u, record.known).y

    @property
    def notes(self) -> tuple[str, ...]:
        """In words, a record each."""
        return tuple(
            f"{one.record.name}: begins in motion; its prediction starts from the state that fits its first "
            f"{one.samples / one.record.sample_rate_hz:.3g} s, which are not scored"
            for one in self.moving
        )


def nats_at_rest(fit: JointFit) -> float:
    """What a start in motion seems to earn, at most, on the records of the fit, which begin at rest: what a
    fit leaves of those is no sign of motion elsewhere. Not less than zero."""
    records = fit.response.records
    return max(0.0, *(MovingStart.of(one, fit, records).nats(fit) for one in records))
