"""The way into the functions of the interface: records checked and posed, notes as warnings."""

from __future__ import annotations

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
        warnings.warn(python_words(sentence), BayesHWWarning, stacklevel=3)


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
    for sentence in found.notes:
        warnings.warn(python_words(sentence), BayesHWWarning, stacklevel=3)
    return found
