"""A word where the first use of an installation compiles what every later one loads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

WORDS = (
    "numerical code that was not needed before is compiled, and kept for the next time: up to a minute or "
    "two ..."
)


class _Teller(event.Listener):  # type: ignore[misc]
    """Calls `say` when the first compilation begins."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say: Callable[[str], None] | None = say

    def on_start(self, event: Any) -> None:  # noqa: ARG002
        """numba's interface."""
        if self._say is not None:
            say, self._say = self._say, None
            say(WORDS)

    def on_end(self, event: Any) -> None:
        """numba's interface."""


@contextmanager
def told_of_compilation(say: Callable[[str], None]) -> Iterator[None]:
    """Calls `say` with WORDS where code is compiled meanwhile that no earlier use has kept; once."""
    with event.install_listener("numba:compile", _Teller(say)):
        yield
