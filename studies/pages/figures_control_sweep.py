"""Figure of limit cycles as the gain of a loop rises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayes_hw.report.page.document import Figure
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas
from bayes_hw.report.page.palette import BLUE, MUTED, VERMILLION


@dataclass(frozen=True)
class GainStep:
    """Shares of the draws at one gain, relative to the critical gain of the point estimate."""

    relative_gain: float
    unstable: float
    predicted: float
    simulated: float
    agreement: float


def cycle_probability(steps: Sequence[GainStep], place: str) -> Figure:
    """Share of the draws with a limit cycle, predicted and simulated, against the gain."""
    gains = [step.relative_gain for step in steps]
    with drawing_settings():
        canvas = new_canvas(2.7)
        axes = canvas.subplots()
        axes.plot(gains, [100 * s.unstable for s in steps], "--", color=MUTED, label="linear loop unstable")
        axes.plot(
            gains, [100 * s.predicted for s in steps], "o-", color=BLUE, markersize=3.5, label="predicted"
        )
        axes.plot(
            gains, [100 * s.simulated for s in steps], "x-", color=VERMILLION, markersize=5, label="simulated"
        )
        axes.set(
            xlabel="gain over the critical gain of the point estimate", ylabel="draws (%)", ylim=(-4, 104)
        )
        canvas.legend(loc="outside upper right", ncols=3)
        return finished(
            canvas,
            f"Probability of a limit cycle {place} as the gain rises: by describing functions, by simulation "
            "of the whole nonlinear loop, and the share of the draws whose linear loop is unstable.",
            f"Three rising curves over {len(steps)} gains.",
        )
