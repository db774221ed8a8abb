"""Trying a bag in a process of its own before it is opened in this one.

Its chunks and files are compressed, and rosbags inflates what they hold, however much that is.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bayes_hw.formats.probe import comes_through, run_limited

PROBE_SECONDS = 10.0
BYTES_PER_SECOND = 5 * 2**20


def is_sound_bag(path: Path) -> bool:
    """Whether a child process can read every message within its limits."""
    files = [each for each in path.rglob("*") if each.is_file()] if path.is_dir() else [path]
    seconds = PROBE_SECONDS + sum(each.stat().st_size for each in files) / BYTES_PER_SECOND
    return comes_through("bayes_hw.formats.bag_probe", {"path": str(path.resolve())}, seconds)


def try_bag(task: Mapping[str, Any]) -> None:
    """What the child does."""
    from rosbags.highlevel import AnyReader

    with AnyReader([Path(task["path"])]) as reader:
        for _ in reader.messages():
            pass


if __name__ == "__main__":
    sys.exit(run_limited(try_bag))
