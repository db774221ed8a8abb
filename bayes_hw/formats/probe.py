"""Trying a file in a process of its own, with limits, before it is opened in this one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from math import ceil
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parents[1]

PATIENCE = 10
"""Seconds of the clock waited for a second of the processor."""

MOST_ADDRESSES = 2**31
MOST_MEMORY = 960 * 2**20
"""Address space and memory of the child in bytes, where the system can limit them: what inflates to more than
it states would take any amount."""

MOST_WRITTEN = 2**30
"""Bytes of a temporary file that a library inflates to."""


def comes_through(module: str, task: Mapping[str, Any], seconds: float) -> bool:
    """Whether `python -m module`, a caller of `run_limited`, comes to its end in these seconds of the
    processor.

    It finds this package where it is, and nothing in the folder that it happens to run in.
    """
    text = json.dumps({**task, "seconds": seconds})
    command = [sys.executable, "-P", "-m", module]
    given = os.environ.get("PYTHONPATH", "")
    places = os.pathsep.join([str(PACKAGE.parent), *filter(None, given.split(os.pathsep))])
    environment = os.environ | {"PYTHONPATH": places}
    try:
        done = subprocess.run(
            command, timeout=PATIENCE * seconds, input=text.encode(), capture_output=True, env=environment
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def run_limited(tried: Callable[[Mapping[str, Any]], None]) -> int:
    """In the child: `tried` with the task within the limits; exit status 0 where it raises nothing."""
    task = json.load(sys.stdin)
    with suppress(ImportError):  # not on Windows
        import resource

        most_of = {
            resource.RLIMIT_AS: MOST_ADDRESSES,
            resource.RLIMIT_DATA: MOST_MEMORY,
            resource.RLIMIT_FSIZE: MOST_WRITTEN,
            resource.RLIMIT_CPU: ceil(task["seconds"]),
        }
        for kind, most in most_of.items():
            limits = [limit for limit in resource.getrlimit(kind) if limit != resource.RLIM_INFINITY]
            resource.setrlimit(kind, (min([most, *limits]),) * 2)
    try:
        tried(task)
    except Exception:
        return 1
    return 0
