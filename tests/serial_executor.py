"""Tasks run one after another in this process: what the tests of blind checks need no workers for."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import Any

from bayes_hw.executor import Executor, Outcome, TaskFunction, run_task


class SerialExecutor(Executor):
    """The interface of the executors without processes."""

    def _completed(
        self, function: TaskFunction, pending: Mapping[int, Any]
    ) -> Generator[tuple[int, Outcome], None, None]:
        for index, task in pending.items():
            yield index, run_task(function, task)
