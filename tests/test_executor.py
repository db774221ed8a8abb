"""Tasks give the same results wherever they run, also when workers die, and none is lost or run for nothing.

Every task leaves one line in a log file each time it finishes, so that the tests can count.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.executor import (
    DaskExecutor,
    LocalExecutor,
    ResultFolder,
    TaskFailedError,
    _serve,
    make_executor,
    run_task,
)

COUNT = 12


def make_tasks(folder: Path, count: int = COUNT, **extra: Any) -> list[dict[str, Any]]:
    seeds = np.random.SeedSequence(7).spawn(count)
    return [{"number": i, "seed": s, "log": folder / "log.txt", **extra} for i, s in enumerate(seeds)]


def draw(task: dict[str, Any]) -> dict[str, Any]:
    """A result that depends on the seed alone, and a line in the log."""
    time.sleep(task.get("seconds", 0.0))
    rng = np.random.default_rng(task["seed"])
    with task["log"].open("a") as log:
        log.write(f"{task['number']}\n")
    return {"number": task["number"], "draws": rng.standard_normal(3).tolist(), "process": "hidden"}


def draw_or_die_once(task: dict[str, Any]) -> dict[str, Any]:
    """Task 3 kills its process the first time it is run."""
    marker = task["log"].with_name("died")
    if task["number"] == 3 and not marker.exists():
        marker.touch()
        os._exit(17)
    return draw(task)


def die(_: dict[str, Any]) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def divide(task: dict[str, Any]) -> float:
    return 1 / task["number"]


def refuse(_: dict[str, Any]) -> None:
    raise InputError("record.csv: row 3 is empty; remove it")


def finished_tasks(folder: Path) -> Counter[int]:
    return Counter(int(line) for line in (folder / "log.txt").read_text().split())


def expected(folder: Path, count: int = COUNT) -> list[Any]:
    other = folder / "expected"
    other.mkdir()
    return [json.loads(run_task(draw, task).result) for task in make_tasks(other, count)]


def test_local_results_are_those_of_a_plain_loop_though_a_process_dies(tmp_path: Path) -> None:
    """Its task is run again, and no other is run twice."""
    assert LocalExecutor(2).map(draw_or_die_once, make_tasks(tmp_path)) == expected(tmp_path)
    assert (tmp_path / "died").exists()
    assert finished_tasks(tmp_path) == Counter(range(COUNT))


@pytest.mark.slow
def test_a_task_that_always_kills_its_process_is_given_up(tmp_path: Path) -> None:
    with pytest.raises(TaskFailedError, match=r"task 0 of 1: every worker .* died \(2 in all\)"):
        LocalExecutor(1, attempts=2).map(die, make_tasks(tmp_path, 1))


def test_an_exception_names_its_task(tmp_path: Path) -> None:
    with pytest.raises(TaskFailedError, match=r"task 0 of 2: ZeroDivisionError.*test_executor\.py:\d+"):
        LocalExecutor(1).map(divide, make_tasks(tmp_path, 2))


def test_an_input_error_stays_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^record.csv: row 3 is empty; remove it$"):
        LocalExecutor(1).map(refuse, make_tasks(tmp_path, 1))


def test_kept_results_are_not_computed_again(tmp_path: Path) -> None:
    """The first run is broken off by a task that fails; the second computes only what is missing."""
    kept = ResultFolder(tmp_path / "kept", "this run")
    for index, task in enumerate(make_tasks(tmp_path)[:5]):
        kept.save(index, run_task(draw, task).result)
    assert LocalExecutor(2).map(draw, make_tasks(tmp_path), kept=kept) == expected(tmp_path)
    assert finished_tasks(tmp_path) == Counter(range(COUNT))


@pytest.mark.slow
def test_a_killed_run_goes_on(tmp_path: Path) -> None:
    """kill -9 of the whole program; its processes end with it, and the next run gives the same results."""
    program = (
        "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[2])\n"
        "from test_executor import *\n"
        "folder = Path(sys.argv[1])\n"
        "if __name__ == '__main__':\n"
        "    LocalExecutor(2).map(draw, make_tasks(folder, seconds=0.2),\n"
        "                         kept=ResultFolder(folder / 'kept', 'this run'))\n"
    )
    script = tmp_path / "program.py"
    script.write_text(program)
    running = subprocess.Popen([sys.executable, str(script), str(tmp_path), str(Path(__file__).parent)])
    wait_for(lambda: len(list((tmp_path / "kept").glob("task_*.json"))) >= 2)
    running.kill()
    running.wait()
    time.sleep(0.5)
    before = len(list((tmp_path / "kept").glob("task_*.json")))
    assert before < COUNT
    kept = ResultFolder(tmp_path / "kept", "this run")
    assert LocalExecutor(2).map(draw, make_tasks(tmp_path), kept=kept) == expected(tmp_path)
    assert set(finished_tasks(tmp_path)) == set(range(COUNT))
    assert finished_tasks(tmp_path).total() <= COUNT + 2


def test_results_of_another_run_are_refused(tmp_path: Path) -> None:
    ResultFolder(tmp_path, "that run").save(0, "1")
    with pytest.raises(InputError, match=r"task_000000.json: the kept result belongs to another run"):
        LocalExecutor(1).map(draw, make_tasks(tmp_path, 1), kept=ResultFolder(tmp_path, "this run"))


@pytest.mark.parametrize("content", ["", "{", "[]", '{"fingerprint": "this run"}', "\xff"])
def test_a_damaged_result_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "task_000000.json").write_text(content, encoding="latin-1")
    with pytest.raises(InputError, match=r"task_000000.json: the kept result is damaged"):
        ResultFolder(tmp_path, "this run").load(0)


def test_a_worker_whose_parent_is_gone_ends_quietly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It finishes its task, which nobody waits for, and raises nothing."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    near, far = multiprocessing.Pipe()
    (task,) = make_tasks(tmp_path, 1)
    near.send((draw, task))
    near.close()
    _serve(far)
    assert (tmp_path / "log.txt").read_text() == "0\n"


def test_an_absent_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"^--scheduler: .* not installed; install bayes-hw\[dask\]$"):
        make_executor(1, "tcp://127.0.0.1:8786")


class Cluster:
    """A Dask scheduler and two workers on the loopback interface, each a process of its own. The scheduler
    gives a task up when a worker dies of it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.processes: list[subprocess.Popen[bytes]] = []
        self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard")
        for _ in range(2):
            self.start_worker()

    def start_worker(self) -> None:
        options = ("--no-nanny", "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1")
        directory = ("--local-directory", str(self.folder / "scratch"))
        self._start("worker", self.address, *options, *directory)

    def stop(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()

    def _start(self, *arguments: str) -> None:
        tests = str(Path(__file__).parent)
        with (self.folder / f"dask_{len(self.processes)}.txt").open("wb") as log:
            self.processes.append(
                subprocess.Popen(
                    [sys.executable, "-m", "dask", *arguments],
                    stdout=log,
                    stderr=log,
                    env=os.environ
                    | {"PYTHONPATH": tests, "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"},
                )
            )


@contextmanager
def dask_cluster(folder: Path) -> Iterator[Cluster]:
    pytest.importorskip("distributed", reason="dask.distributed is not installed (extra: dask)")
    cluster = Cluster(folder)
    try:
        wait_for(lambda: answers(cluster.port))
        yield cluster
    finally:
        cluster.stop()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def wait_for(condition: Any, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.05)


@pytest.mark.slow
def test_a_dask_cluster_that_loses_a_worker_gives_the_same_results(tmp_path: Path) -> None:
    """One of two workers is killed in mid-run; the other one finishes the work, what Dask gave up submitted
    anew. A task that kills its worker at every attempt is given up."""
    killed = []

    class KillOnFirst(ResultFolder):
        def save(self, index: int, result: str) -> None:
            super().save(index, result)
            if len(list(self.folder.glob("task_*.json"))) == 4 and not killed:
                cluster.processes[-1].kill()
                killed.append(index)

    with dask_cluster(tmp_path) as cluster:
        kept = KillOnFirst(tmp_path / "kept", "this run")
        executor = make_executor(1, cluster.address)
        results = executor.map(draw, make_tasks(tmp_path, seconds=0.1), kept=kept)
        assert killed
        assert results == expected(tmp_path)
        assert set(finished_tasks(tmp_path)) == set(range(COUNT))
        with pytest.raises(TaskFailedError, match="task 0 of 2: ZeroDivisionError"):
            executor.map(divide, make_tasks(tmp_path, 2))
        executor = DaskExecutor(cluster.address, attempts=1)
        with pytest.raises(TaskFailedError, match=r"every worker .* died \(1 in all\)"):
            executor.map(die, make_tasks(tmp_path, 1))


def test_an_address_where_nothing_listens_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed (extra: dask)")
    monkeypatch.setattr("bayes_hw.executor.CONNECTION_TIMEOUT_S", 0.5)
    with pytest.raises(InputError, match=r"^--scheduler tcp://127.0.0.1:\d+: no Dask scheduler answers"):
        DaskExecutor(f"tcp://127.0.0.1:{free_port()}").map(draw, make_tasks(tmp_path, 1))
