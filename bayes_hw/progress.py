"""Progress of long work: a bar on a terminal, plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import NoReturn, TextIO

from tqdm import tqdm

SECONDS_BETWEEN_LINES = 10.0


class Task:
    """One piece of work of `total` steps under way."""

    def __init__(self, label: str, total: int, stream: TextIO | None) -> None:
        self.label = label
        self.total = total
        self.done = 0
        self._stream = stream
        self._bar: tqdm[NoReturn] | None = None
        self._last_line = time.monotonic()
        if stream is not None and stream.isatty():
            self._bar = tqdm(total=total, desc=label, file=stream, leave=True, dynamic_ncols=True)
        elif stream is not None:
            print(f"{label} ...", file=stream, flush=True)

    def reach(self, done: int, note: str = "") -> None:
        """Say that `done` of the steps are done, with a short note on the state."""
        step, self.done = done - self.done, done
        if self._bar is not None:
            self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(step)
        elif self._stream is not None and time.monotonic() - self._last_line > SECONDS_BETWEEN_LINES:
            self._last_line = time.monotonic()
            print(f"{self.label}: {done}/{self.total} {note}".rstrip(), file=self._stream, flush=True)

    def __enter__(self) -> Task:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()


class Progress:
    """Makes tasks; `quiet` silences them. The stream is stderr unless given."""

    def __init__(self, quiet: bool = False, stream: TextIO | None = None) -> None:
        self._stream = None if quiet else (stream or sys.stderr)

    def task(self, label: str, total: int) -> Task:
        """Start a task of `total` steps; use it as a context manager."""
        return Task(label, total, self._stream)

    def say(self, message: str) -> None:
        """One plain line."""
        if self._stream is not None:
            print(message, file=self._stream, flush=True)

    @contextmanager
    def stage(self, label: str) -> Iterator[None]:
        """A piece of work of unknown length: its label before, its seconds after."""
        begin = time.monotonic()
        self.say(f"{label} ...")
        yield
        self.say(f"{label}: {time.monotonic() - begin:.1f} s")
