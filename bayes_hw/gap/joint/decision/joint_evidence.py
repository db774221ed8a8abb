"""What the decision from records alone rests on, as plain numbers: kept, it can be decided again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from bayes_hw.gap.joint.residuals.remainder import Remainder
from bayes_hw.gap.joint.search.joint_search import JointAnswer


@dataclass(frozen=True)
class JointEvidence:
    """Nats of every label of the fit after regrowth (`nats`), of the readings' faults (`reading_nats`), of
    every label's best explanation alone over the base (`rivals`) and of the fit over the base (`own`); the
    labels of the fit and what it leaves; the labels that were `followed` to the end of the search, whose
    nats are those of that end."""

    nats: Mapping[str, float]
    reading_nats: Mapping[str, float]
    rivals: Mapping[str, float]
    own: float
    labels: tuple[str, ...]
    remainder: Remainder
    followed: tuple[str, ...] = ()

    @classmethod
    def of(cls, found: JointAnswer) -> JointEvidence:
        """Of a finished search."""
        return cls(
            dict(found.nats),
            dict(found.readings.nats),
            dict(found.rivals),
            found.fit.score - found.base.score,
            found.fit.labels,
            found.remainder,
            found.followed,
        )

    def to_dict(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> JointEvidence:
        """As `to_dict` gives it."""
        return cls(
            content["nats"],
            content["reading_nats"],
            content["rivals"],
            float(content["own"]),
            tuple(content["labels"]),
            Remainder(**content["remainder"]),
            tuple(content.get("followed", ())),
        )
