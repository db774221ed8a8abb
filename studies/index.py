"""reports/index.html: every study with its question, headline numbers and files, from the manifests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, StrictUndefined
from manifest import REPORTS, STUDIES, Manifest, question_of, read_manifest
from markupsafe import Markup

from bayes_hw.files import write_text_atomically
from bayes_hw.report.page.palette import page_colours
from bayes_hw.report.page.render import breakable
from bayes_hw.report.page.rounding import format_duration

LINKS = {"report": "report.html", "PDF": "report.pdf", "results": "results.json", "manifest": "manifest.json"}
NAMES = {"emps": "EMPS", "mujoco": "MuJoCo", "rubin": "Rubin"}
"""Words of a study's file name that are written otherwise."""

GROUPS: tuple[tuple[str, str, tuple[int, ...]], ...] = (
    ("Start here", "a first hour, a whole report, and how often the answers are right", (14, 2, 8)),
    ("Is it right?", "intervals and answers against truths known", (5, 7, 9, 10, 16, 17, 19, 20)),
    ("Is it fast?", "against rivals on the same machine", (6, 21)),
    ("What it says of real axes", "measured records, whose truth nobody knows", (3, 4, 15)),
    ("What the paper leaves open", "its printed model, gains, experiments, loops", (1, 11, 12, 13, 18)),
)
"""Title, a line, and the numbers of the studies; the first group's are shown as cards."""

REST = ("More studies", "")


@dataclass(frozen=True)
class Entry:
    """One study on the page; `links` are names and addresses of the files that are there."""

    name: str
    number: int
    heading: str
    question: str
    manifest: Manifest | None
    duration: str
    links: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Group:
    """Studies that answer one kind of question."""

    title: str
    line: str
    studies: tuple[Entry, ...]


def write_index(reports: Path) -> Path:
    """Write index.html into the folder of reports; the same manifests give the same page."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["breakable"] = breakable
    style = files("bayes_hw.report.page") / "templates" / "report.css"
    page = environment.from_string((STUDIES / "index.html").read_text(encoding="utf-8")).render(
        groups=grouped(list(entries(reports))),
        style=Markup(style.read_text(encoding="utf-8")),
        colours=page_colours(),
    )
    path = reports / "index.html"
    write_text_atomically(path, page)
    return path


def heading_of(study: str) -> str:
    """The name of a study without its number, as words; an acronym stays one."""
    words = " ".join(NAMES.get(word, word) for word in study.split("_")[1:])
    return words[0].upper() + words[1:]


def grouped(studies: list[Entry]) -> list[Group]:
    """The studies by GROUPS, those that none names last."""
    by_number = {study.number: study for study in studies}
    groups = [
        Group(title, line, tuple(by_number.pop(number) for number in numbers if number in by_number))
        for title, line, numbers in GROUPS
    ]
    groups.append(Group(*REST, tuple(by_number.values())))
    return [group for group in groups if group.studies]


def entries(reports: Path) -> Iterator[Entry]:
    """What is known of every study script, in the order of their numbers."""
    for script in sorted(STUDIES.glob("[0-9][0-9]_*.py")):
        manifest = read_manifest(reports / script.stem)
        yield Entry(
            name=script.stem,
            number=int(script.stem[:2]),
            heading=heading_of(script.stem),
            question=question_of(script),
            manifest=manifest,
            duration=format_duration(manifest.seconds) if manifest else "",
            links=tuple(
                (label, f"{script.stem}/{name}")
                for label, name in LINKS.items()
                if (reports / script.stem / name).is_file()
            ),
        )


if __name__ == "__main__":
    print(f"index: {write_index(REPORTS)}")
