"""Where a result comes from: program, command, data, packages and time."""

from __future__ import annotations

import argparse
import platform
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from bayes_hw import __version__
from bayes_hw.record import Record

PACKAGES = ("numpy", "scipy", "numba", "emcee", "arviz-base", "arviz-stats", "matplotlib", "typst")

RESULTS_LEFT_OUT = ":(top,exclude)reports"
"""What git calls every file but the results of the studies, of which each run changes its own."""


@dataclass(frozen=True)
class Provenance:
    """What a reader needs to make the same result again."""

    version: str
    git_state: str
    command: str
    seed: int
    records: tuple[tuple[str, str], ...]
    packages: tuple[tuple[str, str], ...]
    python: str
    machine: str
    seconds: float
    began: float | None = None
    """`time.perf_counter()` when the user began to wait: then what is stated counts from there until the
    page is composed, its figures drawn."""

    @property
    def waited(self) -> float:
        """Seconds."""
        return self.seconds if self.began is None else time.perf_counter() - self.began

    def rows(self) -> tuple[tuple[str, str], ...]:
        """Name and value of every entry, for a table."""
        return (
            ("bayes_hw", f"{self.version} ({self.git_state})"),
            ("command", self.command),
            ("seed", str(self.seed)),
            *self.records,
            ("packages", ", ".join(f"{name} {version}" for name, version in self.packages)),
            ("Python", self.python),
            ("machine", self.machine),
            ("wall time", f"{self.waited:.1f} s"),
        )


def provenance(
    command: str, seed: int, records: Sequence[Record], seconds: float, began: float | None = None
) -> Provenance:
    """The provenance of a result computed here and now; `began` as in `Provenance`."""
    return Provenance(
        version=__version__,
        git_state=git_state(),
        command=command,
        seed=seed,
        records=tuple(dict.fromkeys(_origin(record) for record in records)),
        packages=tuple((name, metadata.version(name)) for name in PACKAGES),
        python=platform.python_version(),
        machine=f"{platform.system()} {platform.machine()}",
        seconds=seconds,
        began=began,
    )


def provenance_of(parsed: argparse.Namespace, records: Sequence[Record] = ()) -> Provenance:
    """That of the command that these options are of, until now."""
    seconds = time.perf_counter() - parsed.begin
    return provenance(parsed.command_line, parsed.seed, records, seconds, parsed.begin)


def _origin(record: Record) -> tuple[str, str]:
    """What a record is called in the table, and its digest or how it was simulated."""
    if record.sha256:
        return f"SHA-256 of {record.source or record.name}", record.sha256
    return f"record {record.name}", record.source or "simulated"


def git_state() -> str:
    """Short commit and whether files other than results are changed; "not a git checkout" for an installed
    package."""
    folder = Path(__file__).parent
    if not (folder.parent / ".git").exists():
        return "not a git checkout"
    try:
        commit = _git(folder, "rev-parse", "--short=12", "HEAD")
        changed = _git(folder, "status", "--porcelain", "--untracked-files=no", "--", ":/", RESULTS_LEFT_OUT)
    except (OSError, subprocess.SubprocessError):
        return "git state unknown"
    return f"commit {commit}" + (", with uncommitted changes" if changed else "")


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True, timeout=10
    )
    return done.stdout.strip()
