"""The diagram of the rooms, drawn from the import contract of pyproject.toml: docs/generated/rooms.svg."""

from __future__ import annotations

import tomllib
from pathlib import Path

from sphinx.application import Sphinx

from bayes_hw.report.page.drawing import drawing_settings, new_canvas
from bayes_hw.report.page.palette import BLUE, INK, MUTED

HERE = Path(__file__).resolve().parents[1]
TARGET = HERE / "generated" / "rooms.svg"

WORDS = {
    "cli": "parse, call, say",
    "commands": "a light module a command",
    "interface": "import bayes_hw: identify, sample, diagnose",
    "report": "one typed report, HTML and PDF",
    "file_validation": "files held against their schemas",
    "file_schemas": "JSON Schemas of the files",
    "analysis": "the whole path for one axis",
    "gap": "simulator against records",
    "control": "margins, loops, tuning",
    "identifiability": "what records cannot tell",
    "infer": "likelihood, sampler, posterior, prediction",
    "identify": "point estimate: order, blocks, noise",
    "model": "what an axis is; the compiled simulator",
    "record": "one measured record",
    "plant": "a torque-level truth",
    "formats": "files of numbers, read within bounds",
}
"""What a room holds, for those that are worth a line."""


def layers() -> list[list[str]]:
    """Rooms from the top down, those of one layer together."""
    content = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contract = content["tool"]["importlinter"]["contracts"][0]
    return [[name.strip() for name in layer.split("|")] for layer in contract["layers"]]


def generate(app: Sphinx) -> None:
    """Draw one row a layer; imports run from each row to those below it."""
    rows = layers()
    with drawing_settings():
        canvas = new_canvas(0.36 * len(rows) + 0.4, 7.2)
        axes = canvas.subplots()
        axes.set_axis_off()
        axes.set(xlim=(0, 1), ylim=(len(rows) + 0.2, -0.4))
        for i, names in enumerate(rows):
            width = 0.9 / len(names)
            for j, name in enumerate(names):
                told = name in WORDS
                box = {"facecolor": BLUE if told else MUTED, "alpha": 0.12 if told else 0.08, "lw": 0}
                axes.add_patch(_rectangle(0.05 + j * width + 0.004, i + 0.05, width - 0.008, 0.86, box))
                axes.text(
                    0.05 + (j + 0.5) * width,
                    i + (0.36 if told else 0.5),
                    name,
                    ha="center",
                    va="center",
                    fontsize=8.5 if told else 7.5,
                    color=INK,
                    fontweight="bold" if told else "normal",
                )
                if told:
                    axes.text(
                        0.05 + (j + 0.5) * width,
                        i + 0.71,
                        WORDS[name],
                        ha="center",
                        va="center",
                        fontsize=6.5,
                        color=INK,
                    )
        axes.annotate(
            "", xy=(0.02, len(rows)), xytext=(0.02, 0), arrowprops={"arrowstyle": "-|>", "color": MUTED}
        )
        axes.text(
            0.0, len(rows) / 2, "imports", rotation=90, va="center", ha="center", fontsize=8, color=MUTED
        )
        TARGET.parent.mkdir(exist_ok=True)
        canvas.savefig(TARGET, format="svg", metadata={"Date": None, "Creator": None})


def _rectangle(x: float, y: float, width: float, height: float, style: dict[str, object]):
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), width, height, **style)


def setup(app: Sphinx) -> dict[str, bool]:
    """Draw before Sphinx looks for its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
