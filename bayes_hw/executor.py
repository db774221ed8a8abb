"""Where many independent tasks run: processes of this machine, or the workers of a Dask cluster.

A task is plain data that carries its own seed (a child of `numpy.random.SeedSequence.spawn`), and its result
is plain data that JSON can hold. So a result does not depend on where, when or after how many deaths of a
worker it was computed, and finished ones can be kept on disk.
"""

from __future__ import annotations

import importlib
import json
import multiprocessing
import signal
import traceback
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, TypeAlias

from bayes_hw.errors import InputError
from bayes_hw.files import write_text_atomically
from bayes_hw.progress import Progress
from bayes_hw.threads import one_blas_thread

ATTEMPTS = 3
"""How often a task is started before the deaths of its workers are held against it."""

CONNECTION_TIMEOUT_S = 10.0

TaskFunction: TypeAlias = Callable[[Any], Any]


class TaskFailedError(RuntimeError):
    """A task raised an exception, or every worker that was given it died."""


@dataclass(frozen=True)
class Outcome:
    """How a task ended: `result` as JSON, or `error` in words (`refused` when it was an InputError)."""

    result: str = ""
    error: str = ""
    refused: bool = False


class ResultFolder:
    """Finished results on disk, one JSON file a task, so that an interrupted run goes on where it was.

    `fingerprint` is a digest of all that decides the results (see `bayes_hw.infer.checkpoint.fingerprint`);
    a file of another run is refused.
    """

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.folder = folder
        self.fingerprint = fingerprint

    def save(self, index: int, result: str) -> None:
        """Keep the result (JSON) of the task counted from 0."""
        content = f'{{"fingerprint": {json.dumps(self.fingerprint)}, "result": {result}}}\n'
        write_text_atomically(self._path(index), content)

    def load(self, index: int) -> str | None:
        """The kept result as JSON, None where there is none.

        Raises InputError when the file is damaged or belongs to another run.
        """
        path = self._path(index)
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError):
            raise InputError(f"{path}: the kept result is damaged; remove the file") from None
        if not isinstance(content, dict) or "result" not in content:
            raise InputError(f"{path}: the kept result is damaged; remove the file")
        if content.get("fingerprint") != self.fingerprint:
            raise InputError(f"{path}: the kept result belongs to another run; remove the folder")
        return json.dumps(content["result"])

    def _path(self, index: int) -> Path:
        return self.folder / f"task_{index:06d}.json"


class Executor(ABC):
    """Runs a function over independent tasks."""

    def map(
        self,
        function: TaskFunction,
        tasks: Sequence[Any],
        *,
        progress: Progress | None = None,
        label: str = "tasks",
        kept: ResultFolder | None = None,
    ) -> list[Any]:
        """The result of every task, in the order of `tasks`, as JSON reads it back (a tuple is a list).

        `function` is a function of a module that the workers can import. With `kept`, results found there
        are not computed again, and each new one is written there as soon as it is known. Raises InputError
        when a task does, TaskFailedError when one raises anything else or its workers keep dying.
        """
        results = {} if kept is None else _kept_results(kept, len(tasks))
        pending = {index: task for index, task in enumerate(tasks) if index not in results}
        with (progress or Progress(quiet=True)).task(label, len(tasks)) as shown:
            shown.reach(len(results))
            with closing(self._completed(function, pending)) as completed:
                for index, outcome in completed:
                    if outcome.refused:
                        raise InputError(outcome.error)
                    if outcome.error:
                        raise TaskFailedError(f"task {index} of {len(tasks)}: {outcome.error}")
                    if kept is not None:
                        kept.save(index, outcome.result)
                    results[index] = outcome.result
                    shown.reach(len(results))
        return [json.loads(results[index]) for index in range(len(tasks))]

    @abstractmethod
    def _completed(
        self, function: TaskFunction, pending: Mapping[int, Any]
    ) -> Generator[tuple[int, Outcome], None, None]:
        """Index and outcome of every pending task, each exactly once, in any order."""


class LocalExecutor(Executor):
    """`jobs` processes of this machine, started afresh for every map and free of state between them.

    The process of a task that dies (killed, out of memory) is replaced and the task started again, at most
    `attempts` times in all; other tasks are not disturbed. Processes are spawned, so a script that maps must
    guard its main program with `if __name__ == "__main__"`.
    """

    def __init__(self, jobs: int = 1, attempts: int = ATTEMPTS) -> None:
        self.jobs = max(1, jobs)
        self.attempts = attempts

    def _completed(
        self, function: TaskFunction, pending: Mapping[int, Any]
    ) -> Generator[tuple[int, Outcome], None, None]:
        waiting = deque(pending)
        starts: Counter[int] = Counter()
        busy: dict[Connection, tuple[BaseProcess, int]] = {}

        def give(process: BaseProcess, connection: Connection) -> None:
            if not waiting:
                _retire(process, connection)
                return
            index = waiting.popleft()
            starts[index] += 1
            busy[connection] = (process, index)
            _send(connection, (function, pending[index]))

        try:
            while waiting or busy:
                while waiting and len(busy) < self.jobs:
                    give(*_start_worker())
                for connection in wait(list(busy)):
                    assert isinstance(connection, Connection)
                    process, index = busy.pop(connection)
                    try:
                        outcome: Outcome = connection.recv()
                    except (EOFError, OSError):
                        _retire(process, connection)
                        if starts[index] < self.attempts:
                            waiting.appendleft(index)
                            continue
                        yield index, _died(starts[index])
                    else:
                        give(process, connection)
                        yield index, outcome
        finally:
            for connection, (process, _) in busy.items():
                process.kill()
                _retire(process, connection)


class DaskExecutor(Executor):
    """The workers of the Dask cluster whose scheduler listens at `address`, such as "tcp://host:8786".

    The workers must have this version of bayes_hw installed. Dask moves the tasks of a worker that dies to
    another one; a task it gives up (scheduler option `allowed-failures`) is submitted anew, at most
    `attempts` times in all. Raises InputError when dask.distributed is not installed, and in `map` when no
    scheduler answers.
    """

    def __init__(self, address: str, attempts: int = ATTEMPTS) -> None:
        try:
            self._distributed = importlib.import_module("distributed")
        except ImportError:
            raise InputError(
                "--scheduler: dask.distributed is not installed; install bayes-hw[dask]"
            ) from None
        self.address = address
        self.attempts = attempts

    def _completed(
        self, function: TaskFunction, pending: Mapping[int, Any]
    ) -> Generator[tuple[int, Outcome], None, None]:
        with self._connect() as client:
            starts: Counter[int] = Counter()
            indices: dict[str, int] = {}

            def submit(index: int) -> Any:
                starts[index] += 1
                future = client.submit(run_task, function, pending[index], pure=False)
                indices[future.key] = index
                return future

            completed = self._distributed.as_completed([submit(index) for index in pending], loop=client.loop)
            for future in completed:
                index = indices[future.key]
                if future.status == "finished":
                    yield index, future.result()
                elif isinstance(future.exception(), self._distributed.scheduler.KilledWorker):
                    if starts[index] < self.attempts:
                        completed.add(submit(index))
                    else:
                        yield index, _died(starts[index])
                else:
                    yield index, Outcome(error=f"{future.status} on the Dask cluster: {future.exception()}")

    def _connect(self) -> Any:
        try:
            return self._distributed.Client(self.address, timeout=CONNECTION_TIMEOUT_S, set_as_default=False)
        except (OSError, ValueError):
            raise InputError(
                f"--scheduler {self.address}: no Dask scheduler answers there; start `dask scheduler`"
            ) from None


def make_executor(jobs: int, scheduler: str | None = None) -> Executor:
    """The Dask cluster at the address `scheduler` where one is given, else `jobs` processes."""
    return LocalExecutor(jobs) if scheduler is None else DaskExecutor(scheduler)


def run_task(function: TaskFunction, task: Any) -> Outcome:
    """Run one task where it was sent, with one BLAS thread; an exception becomes an outcome."""
    try:
        with one_blas_thread():
            return Outcome(result=json.dumps(function(task)))
    except InputError as error:
        return Outcome(error=str(error), refused=True)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return Outcome(error=f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")


def _kept_results(kept: ResultFolder, count: int) -> dict[int, str]:
    found = ((index, kept.load(index)) for index in range(count))
    return {index: result for index, result in found if result is not None}


def _died(starts: int) -> Outcome:
    return Outcome(error=f"every worker that it was given died ({starts} in all)")


def _start_worker() -> tuple[BaseProcess, Connection]:
    context = multiprocessing.get_context("spawn")
    connection, far_end = context.Pipe()
    process = context.Process(target=_serve, args=(far_end,), daemon=True)
    process.start()
    far_end.close()
    return process, connection


def _serve(connection: Connection) -> None:
    """Run what comes until nothing more does or nobody reads; the parent alone answers an interrupt."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            connection.send(run_task(*connection.recv()))
        except (EOFError, BrokenPipeError, ConnectionResetError):
            return


def _send(connection: Connection, job: tuple[TaskFunction, Any]) -> None:
    """Send a job; that its worker has just died shows when its answer is read."""
    try:
        connection.send(job)
    except OSError:
        return


def _retire(process: BaseProcess, connection: Connection) -> None:
    """End a worker, which stops when its connection closes."""
    connection.close()
    process.join()
    process.close()
