"""The figures of the gallery: one simulated case of each effect, and the simulator that lacks it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayes_hw.plant.case import BlindCase, make_case
from bayes_hw.plant.kinds import KINDS
from bayes_hw.plant.nominal import refit
from bayes_hw.report.page.drawing import drawing_settings, new_canvas
from bayes_hw.report.page.palette import BLUE, DATA, MUTED, VERMILLION

PLANT = Path(__file__).resolve().parents[2] / "bayes_hw" / "plant"
SEED = 3
SEGMENT_S = 24.0
KIND = replace(
    KINDS["easy"],
    gap_over_sigma=(4.0, 6.0),
    excitations=("modulated_sweep", "steps_and_triangles", "acceptance_run"),
)
"""Gaps that can be seen by eye."""


def stamp() -> str:
    """A digest of the code that draws the figures."""
    digest = hashlib.sha256()
    for path in [*sorted(PLANT.rglob("*.py")), Path(__file__)]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def draw(label: str, path: Path) -> None:
    """Draw a case of this label: a stretch of it, the error over time, the error over angle by direction."""
    case = make_case(SEED, 0, KIND, [label])
    rate = case.simulator.sample_rate_hz
    fitted = refit(
        case.simulator,
        [record.command for record in case.train],
        [record.without_noise for record in case.train],
    )
    errors = [record.measured - fitted.simulate(record.command) for record in case.train]
    record, error = max(zip(case.train, errors, strict=True), key=lambda pair: float(np.std(pair[1])))
    t = np.arange(len(error)) / rate
    first = most_telling(error, round(SEGMENT_S * rate))
    stretch = slice(first, first + round(SEGMENT_S * rate))
    simulated = record.measured - error
    with drawing_settings():
        canvas = new_canvas(4.6, 7.2)
        top, below = canvas.subfigures(2, 1, height_ratios=[1.15, 1.0])
        axes = top.subplots()
        axes.plot(t[stretch], record.measured[stretch], color=DATA, lw=1.0, label="measured")
        axes.plot(t[stretch], simulated[stretch], color=VERMILLION, lw=1.0, ls="--", label="simulator")
        axes.set(xlabel="time (s)", ylabel="angle (deg)")
        axes.legend(loc="best", fontsize=8)
        over_time, over_angle = below.subplots(1, 2, sharey=True)
        over_time.plot(t, error, color=VERMILLION, lw=0.6)
        over_time.axvspan(t[stretch][0], t[stretch][-1], color=MUTED, alpha=0.12, lw=0)
        over_time.set(xlabel="time (s)", ylabel="error (deg)")
        scatter(over_angle, case, errors, rate)
        canvas.savefig(path, format="svg", metadata={"Date": None, "Creator": None})


def scatter(axes, case: BlindCase, errors: list[np.ndarray], rate: float) -> None:
    """Errors of all training records over the angle, by the direction of motion."""
    measured = np.concatenate([record.noise_free for record in case.train])
    error = np.concatenate(errors)
    speed = np.concatenate([np.gradient(record.noise_free) * rate for record in case.train])
    slow = 0.02 * np.abs(speed).max()
    for name, chosen, colour in (
        ("up", speed > slow, BLUE),
        ("down", speed < -slow, VERMILLION),
        ("at rest", np.abs(speed) <= slow, MUTED),
    ):
        axes.plot(measured[chosen], error[chosen], ".", ms=1.6, color=colour, label=name, rasterized=True)
    axes.set(xlabel="angle (deg)")
    axes.legend(loc="best", fontsize=7, markerscale=4)


def most_telling(error: np.ndarray, samples: int) -> int:
    """Where a stretch of `samples` begins that holds most of the squared error."""
    total = np.concatenate([[0.0], np.cumsum(error**2)])
    return int(np.argmax(total[samples:] - total[:-samples]))
