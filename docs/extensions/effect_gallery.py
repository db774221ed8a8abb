"""The gallery of effects: a page a label, from its description, its classes and the studies that measured it.

The pages and their figures are written to docs/generated/gallery before Sphinx reads its sources. A figure
is drawn again only where the plant or the drawing has changed.
"""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
from effect_figures import draw, stamp
from sphinx.application import Sphinx
from sphinx.util import logging
from study_numbers import REPORTS, looked_up

from bayes_hw.gap.answer.experiment import SHOWS
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.catalogue import block_of, catalogue, known_labels
from bayes_hw.gap.effects.descriptions import DESCRIPTIONS, Description
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.model.parameters import Parameter
from bayes_hw.record import Units

logger = logging.getLogger(__name__)

HERE = Path(__file__).resolve().parents[1]
FOLDER = HERE / "generated" / "gallery"
SCALE = AxisScale(20.0, 120.0, 4.0, 0.4, 0.005, 1.7, (520.0, 190.0), 1.0, Units())
"""An axis of usual size: for the names and units of parameters."""

BLOCK_WORDS = {
    "input": "between command and drive",
    "linear": "in the linear block",
    "drive": "in the drive",
    "disturbance": "a disturbance from outside",
    "sensor": "in the encoder",
}


def described(label: str, effects: tuple[Effect, ...]) -> Description | None:
    """What is said of a label, built in or of another package."""
    if label in DESCRIPTIONS:
        return DESCRIPTIONS[label]
    return next((effect.description for effect in effects if effect.label == label), None)


def law(effect: Effect) -> str:
    """The docstring of an effect: its equation on the first line, then source and limits."""
    first, _, rest = inspect.cleandoc(type(effect).__doc__ or "").partition("\n")
    return f"{first}\n\n{' '.join(rest.split())}".rstrip()


def heading(text: str) -> str:
    """With a capital first letter."""
    return text[:1].upper() + text[1:]


def parameter_rows(parameters: tuple[Parameter, ...]) -> list[str]:
    """A table of parameters with units and what is expected before the records are seen."""
    rows = ["| parameter | unit | prior |", "|---|---|---|"]
    for one in parameters:
        rows.append(f"| `{one.name}` | {one.unit or 'none'} | {type(one.prior).__name__} |")
    return rows


def richer(effects: tuple[Effect, ...]) -> list[Effect]:
    """Effects with the forms that they are refined to."""
    found = list(effects)
    for effect in effects:
        known = {one.name for one in found}
        found += [form for form, _ in effect.refined(np.array(effect.test_values)) if form.name not in known]
    return found


def measured_lines(label: str) -> list[str]:
    """What the studies say of a label; nothing where they have not been run."""
    lines = []
    if (REPORTS / "09_power" / "results.json").exists():
        power = looked_up("09_power", "by_effect").get(label)
        if power:
            low, high = power["interval"]
            size = f"{power['gap']:.2f}" if power["gap"] else "below the smallest tried"
            upto = "beyond those tried" if high is None else f"{high:.2f}"
            lines.append(
                f"- Smallest gap named right with 90 % probability, in units of the noise, "
                f"on records of 120 s: "
                f"{size} (95 % interval {low:.2f} to {upto}, {power['trials']} cases; study 09)."
            )
    if (REPORTS / "10_leave_one_out" / "results.json").exists():
        for entry in looked_up("10_leave_one_out", "entries"):
            if entry["label"] == label:
                named, other = entry["named_with"], entry["other"]
                lines.append(
                    f"- With its entry {named['hits']} of {named['trials']} cases are named, and the gap "
                    f"closes by {100 * entry['closed_with']:.0f} % (median); without it {other['hits']} of "
                    f"{other['trials']} are answered `other` (study 10)."
                )
    return lines


def page(label: str, description: Description, effects: tuple[Effect, ...]) -> str:
    """The page of one label in MyST."""
    forms = richer(tuple(effect for effect in effects if effect.label == label))
    neighbours = "\n".join(
        f"- **[{DESCRIPTIONS[other].title}]({other}.md)** (`{other}`): {how}"
        for other, how in description.neighbours.items()
    )
    parts = [
        f"# {description.title}",
        f"`{label}`, {BLOCK_WORDS[block_of(label, effects)]}: {description.meaning}.",
        "## What it looks like",
        description.looks,
        f"```{{figure}} {label}.svg\n:alt: A simulated record with {description.title.lower()} and the error "
        f"of its simulator\n\nA simulated axis with this effect, and the simulator without it, its base "
        "parameters estimated again. Above the stretch with most of the error; below the error over time and "
        "over the angle, by direction of motion.\n```",
        "## How it is told from its neighbours",
        neighbours,
        f"The experiment that shows it alone: {SHOWS[label]}." if label in SHOWS else "",
        "## What to do about it",
        description.remedy,
        "## What the catalogue holds" if forms else "## Its law",
        description.law,
    ]
    for form in forms:
        parts += [
            f"### {heading(form.form or description.title)}",
            law(form),
            "\n".join(parameter_rows(form.parameters(SCALE))),
        ]
    measured = measured_lines(label)
    if measured:
        parts += ["## How well it is found", "\n".join(measured)]
    return "\n\n".join(part for part in parts if part) + "\n"


def index(labels: list[str], effects: tuple[Effect, ...]) -> str:
    """The gallery's first page."""
    rows = ["| effect | label | where | in one line |", "|---|---|---|---|"]
    for label in labels:
        found = described(label, effects)
        assert found is not None
        rows.append(
            f"| [{found.title}]({label}.md) | `{label}` | {BLOCK_WORDS[block_of(label, effects)]} | "
            f"{found.meaning} |"
        )
    toc = "\n".join(labels)
    return (
        f"# Gallery of effects\n\nWhat a simulator may lack: {len(labels)} effects that `bayes-hw diagnose` "
        "can name. Each page shows what the effect looks like in a record, how it is told from its "
        "neighbours and what to do about it, and is made from the classes of the catalogue.\n\n"
        + "\n".join(rows)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{toc}\n```\n"
    )


def write_if_changed(path: Path, text: str) -> None:
    """Write a page unless it is there already, so that Sphinx reads again only what changed."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def generate(app: Sphinx) -> None:
    """Write pages and figures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    effects = catalogue()
    labels = [label for label in known_labels() if described(label, effects)]
    drawn, now = FOLDER / "figures.sha256", stamp()
    fresh = drawn.exists() and drawn.read_text() == now
    for label in labels:
        figure = FOLDER / f"{label}.svg"
        if label in DESCRIPTIONS and not (fresh and figure.exists()):
            logger.info("drawing %s", label)
            draw(label, figure)
        found = described(label, effects)
        assert found is not None
        write_if_changed(FOLDER / f"{label}.md", page(label, found, effects))
    write_if_changed(FOLDER / "index.md", index(labels, effects))
    drawn.write_text(now)


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
