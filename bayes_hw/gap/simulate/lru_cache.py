"""An LRU cache for threads, to which results are added in batches, as `functools.lru_cache` cannot."""

from __future__ import annotations

from threading import Lock
from typing import Generic, TypeVar

Key = TypeVar("Key")
Result = TypeVar("Result")


class LruCache(Generic[Key, Result]):
    """Keeps the `size` results that were added or asked for last."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._results: dict[Key, Result] = {}
        self._lock = Lock()

    def __getitem__(self, key: Key) -> Result | None:
        """What was kept for `key`, or None."""
        with self._lock:
            result = self._results.pop(key, None)
            if result is not None:
                self._results[key] = result
        return result

    def __setitem__(self, key: Key, result: Result) -> None:
        with self._lock:
            self._results.pop(key, None)
            self._results[key] = result
            while len(self._results) > self.size:
                del self._results[next(iter(self._results))]
