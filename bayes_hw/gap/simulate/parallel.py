"""The same work on every item, in threads: the compiled simulator leaves the interpreter free."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

Given = TypeVar("Given")
Made = TypeVar("Made")


@dataclass(frozen=True)
class Each:
    """Maps work over items with `jobs` threads, results in order."""

    jobs: int = 1

    def __call__(self, work: Callable[[Given], Made], items: Sequence[Given]) -> list[Made]:
        def quietly(item: Given) -> Made:
            """Trial parameters may overflow; such trials have no finite cost and are not taken."""
            with np.errstate(all="ignore"):
                return work(item)

        if self.jobs == 1:
            return [quietly(item) for item in items]
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(quietly, items))
