"""The constants by which nats become probabilities where records alone are diagnosed."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from typing import ClassVar, Self

import numpy as np


@dataclass(frozen=True)
class JointCalibration:
    """Those of FILE, which states beside every value the standard deviation of its logarithm: how well the
    cases that it was fitted to tell it.

    `doubt` is that of a label of no nats, which falls by a factor e with every `nats_of_doubt` (forms are
    never exact, so that nats count for less than they say); `floor` is the least doubt of an effect named
    alone, `pair_floor` of one of two, `other_floor` of `other`, since the search can have missed a cause, and
    `coloured_floor` of any effect where the noise that is left counts as a cause and so hides something, in
    proportion where it nearly does, `cut_short_floor` where the search had no time left to look for others;
    `none_doubt` that of no gap where nothing is found; `other_unseen` the chance that there is something
    without a name though nothing says so, and `other_coloured` the same where the noise that is left counts
    as a cause; `nearly_found` the doubt of no gap where an effect would have been found at no nats more,
    which falls by a factor e with every `nats_nearly_found`. That there is no gap beside labels of so many
    nats has the doubts that fall by e with every `nats_of_gap`: another cause has fewer to explain away. Of
    two labels the odds are e for every `nats_between` that one explains more in place of the other, and every
    `share_between` of all nats explained: the more an effect moves, the more the error of its form is worth.
    Of two causes of the noise, whose likelihoods are exact, they are e for every `nats_between_causes`; from
    `nats_refuting` on what a cause says disturbed the axis, or knows of the command, is no chance, and it is
    not that cause. `others_share` is what causes without a name have of the doubt of a label that many nats
    speak for. A label that was not followed to the end but earns alone more than the share `near` of the
    answer's nats keeps the answer in doubt: one without a name with `near_doubt`, one with a name, beside an
    answer without, with `named_share` of that answer's probability. `unnamed_base` is the share that the axis
    without effects has of the draws of base parameters beside a law without a name. `beside_other` is the
    most that any label has beside an answer that is `other` alone, `least` the least that is stated.

    A label beside one of the answer explains the records as well within `nats_as_good`. Beside a form without
    a name a label is certain from the share `least_beside` of its nats on: no such form is exact, and what
    mends it a little is no effect of its own. Jitter may have caused `colour_of_jitter` nats of noise of high
    order for every nat of its own.
    """

    FILE: ClassVar[str] = "joint_calibration.json"

    doubt: float
    nats_of_doubt: float
    floor: float
    pair_floor: float
    other_floor: float
    coloured_floor: float
    cut_short_floor: float
    none_doubt: float
    other_unseen: float
    other_coloured: float
    nearly_found: float
    nats_nearly_found: float
    nats_of_gap: float
    nats_between: float
    share_between: float
    nats_between_causes: float
    nats_refuting: float
    others_share: float
    near: float
    near_doubt: float
    named_share: float
    unnamed_base: float
    beside_other: float
    least: float
    nats_as_good: float
    least_beside: float
    colour_of_jitter: float

    def sure(self, nats: float, floor: float) -> float:
        """Probability of a label of so many nats, its doubt at least `floor`."""
        return 1 - max(floor, self.doubt * float(np.exp(-max(nats, 0.0) / self.nats_of_doubt)))

    def nothing(self, nats: Iterable[float]) -> float:
        """Probability that there is no gap where labels of so many nats were found."""
        found = [self.doubt * float(np.exp(-max(one, 0.0) / self.nats_of_gap)) for one in nats]
        return float(np.prod(found))

    def odds(self, lead: float, own: float, causes: bool) -> float:
        """Of a label to one that leads it by so many nats and explains `own`; of `causes` of the noise."""
        if causes:
            return float(np.exp(-lead / self.nats_between_causes))
        return float(np.exp(-lead / (self.nats_between + self.share_between * max(own, 0.0))))

    @classmethod
    def built_in(cls) -> Self:
        """The constants that come with the program."""
        text = files("bayes_hw.gap.joint.decision").joinpath(cls.FILE).read_text(encoding="utf-8")
        return cls(**{name: content["value"] for name, content in json.loads(text).items()})
