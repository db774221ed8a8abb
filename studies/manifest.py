"""manifest.json of a study's folder: what was asked and found, by which code, and which files say so."""

from __future__ import annotations

import ast
import hashlib
import json
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import bayes_hw
from bayes_hw.files import write_text_atomically
from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import Report

SCHEMA = "bayes-hw/study/1"
FILE_NAME = "manifest.json"
STUDIES = Path(__file__).resolve().parent
REPORTS = STUDIES.parent / "reports"
PACKAGE = Path(bayes_hw.__file__).resolve().parent
WITHOUT_NUMBERS = {"index.py", "manifest.py"}
"""Scripts beside the studies that change no result."""

NOT_KEPT = ("*.nc", "bands_*.csv")
"""Files of a study that are too large to commit, and that its seed makes again."""

SOURCE_ENDINGS = (".py", ".json", ".html", ".css", ".js", ".typ")


@dataclass(frozen=True)
class Manifest:
    """One finished run of one study.

    `headline` holds the verdict and the badges of the report's first page; `code` the SHA-256 of everything
    that decides the numbers (see `code_digest`), None where it is not known; `files` the SHA-256 of each
    file of the run, by name.
    """

    study: str
    title: str
    question: str
    headline: dict[str, Any]
    version: str
    code: str | None
    seed: int
    quick: bool
    command: str
    python: str
    machine: str
    packages: dict[str, str]
    seconds: float
    files: dict[str, str]
    remark: str | None = None

    def write(self, folder: Path) -> None:
        """Write manifest.json into the folder of the study."""
        content = {"schema": SCHEMA, **asdict(self)}
        write_text_atomically(folder / FILE_NAME, json.dumps(content, indent=1, ensure_ascii=False) + "\n")

    def is_done(self, folder: Path, code: str, command: str) -> bool:
        """Whether that command by that code has made the files that lie in `folder`, unchanged since."""
        return (self.code, self.command) == (code, command) and all(
            (folder / name).is_file() and digest(folder / name) == known for name, known in self.files.items()
        )


def new_manifest(
    study: str,
    script: Path,
    report: Report,
    origin: Provenance,
    *,
    quick: bool,
    folder: Path,
    files: Iterable[str],
) -> Manifest:
    """The manifest of a run of `script` that has just written `files` into `folder`."""
    return Manifest(
        study=study,
        title=report.title,
        question=question_of(script),
        headline={
            "verdict": report.verdict,
            "badges": [asdict(badge) for badge in report.badges],
        },
        version=origin.version,
        code=code_digest(script),
        seed=origin.seed,
        quick=quick,
        command=origin.command,
        python=origin.python,
        machine=origin.machine,
        packages=dict(origin.packages),
        seconds=round(origin.seconds, 1),
        files={name: digest(folder / name) for name in sorted(files) if is_kept(name)},
    )


def is_kept(name: str) -> bool:
    """Whether a file of a study is committed, as .gitignore has it."""
    return not any(fnmatch(name, pattern) for pattern in NOT_KEPT)


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest that lies in a study's folder, or None where there is none of this schema."""
    path = folder / FILE_NAME
    if not path.is_file():
        return None
    content = json.loads(path.read_text(encoding="utf-8"))
    return Manifest(**content) if content.pop("schema", None) == SCHEMA else None


def question_of(script: Path) -> str:
    """The first sentence of a study's docstring, on one line."""
    docstring = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    first = re.split(r"(?<=[.?])\s+(?=[A-Z])", " ".join(docstring.split()), maxsplit=1)[0]
    return first.replace("+-", "±")


def code_digest(script: Path) -> str:
    """SHA-256 over the sources of the package, what studies import beside it, and the script, with names."""
    sources = sorted(path for path in PACKAGE.rglob("*") if path.suffix in SOURCE_ENDINGS)
    beside = sorted(
        path
        for path in (*STUDIES.glob("[a-z]*.py"), *STUDIES.glob("pages/*.py"))
        if path.name not in WITHOUT_NUMBERS
    )
    total = hashlib.sha256()
    for path in [*sources, *beside, script]:
        name = path.relative_to(PACKAGE.parent) if path.is_relative_to(PACKAGE) else path.name
        total.update(f"{name}\0{digest(path)}\n".encode())
    return total.hexdigest()


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
