"""The one exception that a user's input may raise, and the category of what is warned of."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """An input that cannot be used.

    The message is one line that names the file, the row or key, and the remedy; the command line prints
    it on stderr and ends with exit status 2.
    """


class BayesHWWarning(UserWarning):
    """What was done without being asked, or must be known beside a result."""


@contextmanager
def solvable(named: str) -> Iterator[None]:
    """Equations of a fit without a solution in floating point are an InputError that begins with `named`."""
    try:
        yield
    except ValueError as error:
        if type(error).__name__ != "LinAlgError":
            raise
        raise InputError(
            f"{named}: no fit is possible in floating point; check the units of the records and of the "
            "model, and that the records hold measured noise: a simulation without any leaves nothing to "
            "estimate it from"
        ) from error


def storable_text(text: str, label: str) -> str:
    """`text`, which files can hold; raises InputError where it has a null character or half of a pair."""
    if "\0" in text or any("\ud800" <= character <= "\udfff" for character in text):
        raise InputError(f"{label}: {text!r} is no text that a file can hold; leave out what is escaped")
    return text
