"""Threads that share the work of nested loops: whichever loop has items left takes a free one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Lock, Semaphore, Thread
from typing import Generic, TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")

_FREE: ContextVar[Semaphore | None] = ContextVar("free", default=None)
"""Threads that no loop has taken, of the crew that this context works with."""


@contextmanager
def crew(size: int) -> Iterator[None]:
    """Every `each` inside the block shares `size` threads, its own among them."""
    token = _FREE.set(Semaphore(size - 1) if size > 1 else None)
    try:
        yield
    finally:
        _FREE.reset(token)


def each(work: Callable[[Given], Made], items: Sequence[Given]) -> list[Made]:
    """`work` done on every item, results in order, by this thread and whichever of its `crew` are free while
    items are left. Work that compiled kernels do leaves the interpreter free. The first error of the items
    in order is raised."""
    free = _FREE.get()
    if free is None or len(items) < 2:
        return [work(item) for item in items]
    return _Shared(work, items, free).done()


class _Shared(Generic[Given, Made]):
    """One loop over items by several threads."""

    def __init__(self, work: Callable[[Given], Made], items: Sequence[Given], free: Semaphore) -> None:
        self.work, self.items, self.free = work, items, free
        self.left, self.lock = iter(range(len(items))), Lock()
        self.made: dict[int, Made] = {}
        self.errors: dict[int, BaseException] = {}
        self.helpers: list[Thread] = []

    def done(self) -> list[Made]:
        self._take()
        if self.helpers:
            # Waiting takes no place: a longer branch may have it.
            self.free.release()
            for helper in self.helpers:
                helper.join()
            self.free.acquire()
        if self.errors:
            raise self.errors[min(self.errors)]
        return [self.made[number] for number in range(len(self.items))]

    def _take(self) -> None:
        """Work on items while any are left and none has failed."""
        while True:
            with self.lock:
                number = None if self.errors else next(self.left, None)
                if number is None:
                    return
                if number < len(self.items) - 1 and self.free.acquire(blocking=False):
                    helper = Thread(target=copy_context().run, args=(self._help,))
                    self.helpers.append(helper)
                    helper.start()
            try:
                self.made[number] = self.work(self.items[number])
            except BaseException as error:
                self.errors[number] = error

    def _help(self) -> None:
        try:
            self._take()
        finally:
            self.free.release()
