"""Diagrams of the rooms, drawn from the import contracts of pyproject.toml: docs/generated/*.svg."""

from __future__ import annotations

import tomllib
from pathlib import Path

from sphinx.application import Sphinx

from bayes_hw.report.page.drawing import drawing_settings, new_canvas
from bayes_hw.report.page.palette import BLUE, INK, MUTED

HERE = Path(__file__).resolve().parents[1]
TARGETS = {
    "bayes_hw": "rooms.svg",
    "bayes_hw.gap": "diagnosis_rooms.svg",
    "bayes_hw.gap.joint": "search_rooms.svg",
}
"""The figure of each folder whose rooms a contract puts in order."""

WORDS = {
    "cli": "parse, call, say",
    "commands": "a light module a command",
    "interface": "import bayes_hw: identify, sample, diagnose",
    "report": "one typed report, HTML and PDF",
    "file_schemas": "JSON Schemas, and files held against them",
    "analysis": "the whole path for one axis",
    "gap": "simulator against records",
    "simulators": "MuJoCo models and FMUs, corrected",
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

WORDS_OF_GAP = {
    "blind": "cases of known faults, and the score",
    "diagnosis": "pose, search, criticise, answer, measure",
    "joint": "records alone: structure, effect, noise at once",
    "answer": "labels, probabilities, how far the gap closes",
    "search": "strategies in a list",
    "criticism": "what an explanation leaves",
    "fit": "least squares, evidence, posterior draws",
    "noise": "random causes, alone and two at once",
    "effects": "one class an effect",
    "simulate": "the compiled axis with effects",
    "case": "simulator and records",
}

WORDS_OF_SEARCH = {
    "joint_diagnosis": "search, decide, draw, say",
    "answer": "advice, views, the corrected model",
    "decision": "nats become probabilities",
    "posterior": "draws; how far the gap closes",
    "given": "around a model that was given",
    "search": "effects proposed, descended, verified",
    "residuals": "tones, jumps, rhythms",
    "fit": "structure, effects, noise descended at once",
    "response": "the compiled axis and its derivatives",
    "noise": "slow parts, faults of reading",
    "forms": "forms of effects that can be proposed",
}

TOLD = {"bayes_hw": WORDS, "bayes_hw.gap": WORDS_OF_GAP, "bayes_hw.gap.joint": WORDS_OF_SEARCH}


def layers(folder: str) -> list[list[str]]:
    """Rooms of a folder from the top down, those of one layer together."""
    content = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = content["tool"]["importlinter"]["contracts"]
    contract = next(one for one in contracts if one.get("containers") == [folder])
    return [[name.strip() for name in layer.split("|")] for layer in contract["layers"]]


def generate(app: Sphinx) -> None:
    """Draw every figure."""
    for folder, target in TARGETS.items():
        draw(layers(folder), TOLD[folder], HERE / "generated" / target)


def draw(rows: list[list[str]], words: dict[str, str], target: Path) -> None:
    """One row a layer; imports run from each row to those below it."""
    with drawing_settings():
        canvas = new_canvas(0.36 * len(rows) + 0.4, 7.2)
        axes = canvas.subplots()
        axes.set_axis_off()
        axes.set(xlim=(0, 1), ylim=(len(rows) + 0.2, -0.4))
        for i, names in enumerate(rows):
            width = 0.9 / len(names)
            for j, name in enumerate(names):
                told = name in words
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
                        words[name],
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
        target.parent.mkdir(exist_ok=True)
        canvas.savefig(target, format="svg", metadata={"Date": None, "Creator": None})


def _rectangle(x: float, y: float, width: float, height: float, style: dict[str, object]):
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), width, height, **style)


def setup(app: Sphinx) -> dict[str, bool]:
    """Draw before Sphinx looks for its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
