"""The way into the functions of the interface: records checked and posed, notes as warnings."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Collection, Iterable, Sequence

from bayes_hw.entrance import SimulatedAxis, enter
from bayes_hw.errors import BayesHWWarning
from bayes_hw.posing import Origin, Posed, Start
from bayes_hw.python_words import python_words
from bayes_hw.record import Record


def warn_of(sentences: Iterable[str]) -> None:
    """Every sentence as a BayesHWWarning that points at the caller's line."""
    for sentence in sentences:
        warnings.warn(python_words(sentence), BayesHWWarning, stacklevel=_frames_within() + 1)


def _frames_within() -> int:
    """How many frames of this package stand between the caller's line and the one that asks."""
    frame, count = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] == "bayes_hw":
        frame, count = frame.f_back, count + 1
    return count - 1


def entered(
    records: Sequence[Record],
    holdout: Sequence[Record] = (),
    *,
    model: SimulatedAxis | None = None,
    start: Start = "auto",
    origin: Origin = "start",
    accept: Collection[str] = (),
) -> Posed:
    """`bayes_hw.entrance.enter`, its notes as warnings."""
    found = enter(records, holdout, model=model, start=start, origin=origin, accepted=accept)
    warn_of(found.notes)
    return found
