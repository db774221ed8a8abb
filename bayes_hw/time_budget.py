"""Time that long work may take: whatever runs in it asks whether any is left."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

SEARCH_S = 180.0
"""That the search of a diagnosis has unless something else is said."""

_END: ContextVar[float] = ContextVar("end", default=float("inf"))
"""Of the work in this context, by the monotonic clock."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """What runs inside the block has `seconds`, and no more than a block around it leaves."""
    token = _END.set(min(_END.get(), time.monotonic() + seconds))
    try:
        yield
    finally:
        _END.reset(token)


def seconds_left() -> float:
    """That the innermost block leaves; infinite outside of any, negative when time is up."""
    return _END.get() - time.monotonic()


def time_is_up() -> bool:
    return seconds_left() <= 0
