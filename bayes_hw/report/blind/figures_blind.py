"""Figures of a blind check: who was taken for whom, how sure it was, what it closed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from bayes_hw.gap.blind.counts import CLASSES, ReliabilityBin, Share
from bayes_hw.gap.blind.score import Closure
from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawable, drawing_settings, finished, new_canvas
from bayes_hw.report.page.palette import BLUE, INK, MUTED, NOMINAL, ORANGE, VERMILLION

DARK_CELL = 0.55
CLOSURE_RANGE = (-0.6, 1.05)


def shares(groups: Mapping[str, Share], what: str, goal: float | None = None) -> Figure:
    """One row a group: share named right with its 95 % binomial interval."""
    names = list(groups)
    with drawing_settings():
        canvas = new_canvas(0.7 + 0.21 * max(len(names), 3))
        axes = canvas.subplots()
        for row, name in enumerate(names):
            entry = groups[name]
            low, high = entry.interval
            colour = _share_colour(entry, goal)
            axes.plot([100 * low, 100 * high], [row, row], color=colour, linewidth=1.8)
            if entry.trials:
                marker = "o" if colour == BLUE else "D"
                axes.plot(100 * entry.value, row, marker, color=colour, markersize=4)
        if goal is not None:
            axes.axvline(100 * goal, color=INK, linestyle="--", linewidth=0.9)
        labels = [drawable(f"{name} ({groups[name].hits}/{groups[name].trials})") for name in names]
        axes.set_yticks(range(len(names)), labels)
        axes.set(xlim=(-2, 102), ylim=(max(len(names), 1) - 0.5, -0.5), xlabel="named right (%)")
        axes.grid(False, axis="y")
        return finished(
            canvas,
            f"{what}: share named exactly right, with 95 % binomial intervals (Clopper-Pearson)."
            + (
                ""
                if goal is None
                else " Dashed: the goal. Discs: met; diamonds: missed, in amber where the interval still "
                "holds the goal, in red-orange where it excludes it."
            ),
            f"Shares of {len(names)} groups with intervals.",
        )


def _share_colour(entry: Share, goal: float | None) -> str:
    """Blue where a goal is met, amber where it is missed but lies in the interval, else red-orange."""
    if goal is None or not entry.trials or entry.value >= goal:
        return BLUE
    return ORANGE if entry.interval[1] >= goal else VERMILLION


def confusion_matrix(table: Mapping[str, Mapping[str, int]]) -> Figure:
    """Rows: what the case carries; columns: the answer; shading: share of the row."""
    order = [*CLASSES, "two or more", "no verdict"]
    rows = [name for name in order if name in table]
    answers = {answer for counts in table.values() for answer in counts}
    columns = [name for name in order if name in answers | set(rows)]
    counts = np.array([[table[row].get(column, 0) for column in columns] for row in rows])
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    with drawing_settings():
        canvas = new_canvas(1.6 + 0.24 * len(rows))
        axes = canvas.subplots()
        shades = LinearSegmentedColormap.from_list("shares", ["#ffffff", BLUE])
        axes.pcolormesh(share, cmap=shades, vmin=0, vmax=1, edgecolors="#e6e6e6", linewidth=0.4)
        for (row, column), count in np.ndenumerate(counts):
            if count:
                colour = "white" if share[row, column] > DARK_CELL else INK
                axes.text(column + 0.5, row + 0.5, str(count), ha="center", va="center", size=7, color=colour)
        axes.set_xticks(np.arange(len(columns)) + 0.5, columns, rotation=60, ha="right", size=7.5)
        axes.set_yticks(np.arange(len(rows)) + 0.5, rows, size=7.5)
        axes.set(xlabel="answer", ylabel="truth")
        axes.invert_yaxis()
        axes.grid(False)
        return finished(
            canvas,
            "Confusion matrix: cases by what they carry (rows) and by the answer (columns). An answer in the "
            "row of pairs stands under its only label where it names one.",
            f"Matrix of {len(rows)} truths by {len(columns)} answers.",
        )


def reliability_diagram(classes: Sequence[ReliabilityBin], answers: Sequence[ReliabilityBin]) -> Figure:
    """Stated probability against how often it was true, for every class and for the answers."""
    with drawing_settings():
        canvas = new_canvas(2.9)
        for axes, bins, title in zip(
            canvas.subplots(1, 2, sharey=True),
            (classes, answers),
            ("every stated probability", "the answer's"),
            strict=True,
        ):
            axes.plot([0, 100], [0, 100], color=NOMINAL, linewidth=0.8)
            for entry in bins:
                low, high = entry.share.interval
                colour = BLUE if low <= entry.mean <= high else VERMILLION
                axes.plot([100 * entry.mean] * 2, [100 * low, 100 * high], color=colour, linewidth=1.8)
                axes.plot(100 * entry.mean, 100 * entry.share.value, "o", color=colour, markersize=4)
            axes.set_title(title)
            axes.set(xlim=(-3, 103), ylim=(-3, 103), xlabel="stated (%)")
        canvas.axes[0].set_ylabel("true (%)")
        return finished(
            canvas,
            "Reliability: statements binned by their probability, and the share of them that were true, with "
            "95 % binomial intervals. On the line is honest, below it too sure of itself; orange: the "
            "interval misses the line. Left: the probability of every class in every case; right: that of "
            "the answer, true when it is exactly what the case carries.",
            f"Reliability diagrams with {len(classes)} and {len(answers)} bins.",
        )


def closure_scatter(closures: Sequence[Closure]) -> Figure:
    """Claimed against true explained fraction on the noise-free hold-out."""
    low, high = CLOSURE_RANGE
    with drawing_settings():
        canvas = new_canvas(3.6, 4.2)
        axes = canvas.subplots()
        axes.plot([low, high], [low, high], color=NOMINAL, linewidth=0.8)
        for closure in closures:
            x = float(np.clip(closure.true, low, high))
            colour = BLUE if closure.held else VERMILLION
            axes.plot([x, x], np.clip(closure.interval, low, high), color=colour, linewidth=0.8, alpha=0.6)
            marker = "o" if closure.named_right else "x"
            claimed = float(np.clip(closure.claimed, low, high))
            axes.plot(x, claimed, marker, color=colour, markersize=3.5, markerfacecolor="none")
        axes.axhline(0, color=MUTED, linewidth=0.5)
        axes.axvline(0, color=MUTED, linewidth=0.5)
        axes.set(xlim=(low, high), ylim=(low, high), xlabel="true explained fraction", ylabel="claimed")
        return finished(
            canvas,
            "How far the gap shrinks: fraction of the squared hold-out error removed, claimed (with 94 % "
            "interval) against true on the noise-free hold-out; values beyond the frame are drawn on it. "
            "Circles: named right; crosses: named wrong; orange: the interval misses the truth.",
            f"{len(closures)} claimed closures against true ones.",
        )
