"""The report of the study beside mujoco.sysid: estimates, coverage of intervals, seconds, and the answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import Badge, Figure, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas, plain_log_ticks
from bayes_hw.report.page.palette import BLUE, INK, MUTED, VERMILLION
from bayes_hw.report.page.rounding import format_number

METHODS = ("sysid", "sysid, friction given", "diagnosis")
LABEL = "friction"


@dataclass(frozen=True)
class Outcome:
    """One method on one axis, which `rubs` or not: relative errors of the parameters by name, whether their
    intervals hold the truth, half their widths (relative), the error on the record held out in units of the
    noise, CPU seconds."""

    method: str
    rubs: bool
    answer: list[str]
    errors: dict[str, float]
    held: dict[str, bool]
    half_widths: dict[str, float]
    holdout: float
    seconds: float


def outcomes_by_case(outcomes: Sequence[Outcome]) -> dict[str, dict[str, float]]:
    """Of every method with and without friction: axes, coverage, root mean square error of the parameters in
    half intervals, error held out, seconds, and the share of right answers of the diagnosis."""
    found = {}
    for rubs in (False, True):
        for method in METHODS:
            own = [each for each in outcomes if each.method == method and each.rubs == rubs]
            if not own:
                continue
            held = [value for each in own for value in each.held.values()]
            ratios = [each.errors[n] / each.half_widths[n] for each in own for n in each.errors]
            summary = {
                "axes": float(len(own)),
                "intervals": float(len(held)),
                "held": float(sum(held)),
                "error_in_half_intervals": float(np.sqrt(np.mean(np.square(ratios)))),
                "holdout_in_sigmas": float(np.mean([each.holdout for each in own])),
                "cpu_seconds": float(np.mean([each.seconds for each in own])),
            }
            if method == "diagnosis":
                right = [LABEL] if rubs else []
                summary["answered_right"] = float(sum(each.answer == right for each in own))
            found[f"{method}, {'friction' if rubs else 'none'}"] = summary
    return found


def sysid_report(outcomes: Sequence[Outcome], provenance: Provenance) -> Report:
    """The report whose first page shows every error in units of its interval."""
    cases = outcomes_by_case(outcomes)
    rows = tuple(
        (
            name,
            f"{case['axes']:.0f}",
            f"{case['held']:.0f} of {case['intervals']:.0f}",
            format_number(case["error_in_half_intervals"], 3),
            format_number(case["holdout_in_sigmas"], 4),
            format_number(case["cpu_seconds"], 3),
            f"{case['answered_right']:.0f} of {case['axes']:.0f}" if "answered_right" in case else "–",
        )
        for name, case in cases.items()
    )
    blind, own = cases["sysid, friction"], cases["diagnosis, friction"]
    verdict = (
        f"Where the file lacks the friction, the intervals of least squares hold {blind['held']:.0f} of "
        f"{blind['intervals']:.0f} true parameters, and the errors are "
        f"{format_number(blind['error_in_half_intervals'], 3)} times half an interval; the diagnosis names "
        f"the friction on {own['answered_right']:.0f} of {own['axes']:.0f} axes and its intervals hold "
        f"{own['held']:.0f} of {own['intervals']:.0f}."
    )
    table = Table(
        ("method, fault", "axes", "intervals that hold", "error / half interval", "held out / noise",
         "CPU s", "answers right"),
        rows,
        "Least squares states 95 % intervals, the diagnosis 94 %. Errors are root mean squares over axes and "
        "parameters.",
    )  # fmt: skip
    return Report(
        title="Beside mujoco.sysid",
        subtitle="One MuJoCo axis, its parameters drawn, with and without friction that the file lacks",
        verdict=verdict,
        badges=(
            Badge("friction named", "good" if own["answered_right"] == own["axes"] else "warn",
                  f"{own['answered_right']:.0f} of {own['axes']:.0f}"),
        ),
        key_figure=errors_in_half_intervals(outcomes),
        sections=(
            Section("By method", (table,)),
            Section(
                "What is compared",
                (
                    Paragraph(
                        "Both estimate the same parameters on the same simulator and records. Least squares "
                        "is given the structure and no prior; the diagnosis is given the file and the spread "
                        "of its parameters, and must find out whether anything is missing."
                    ),
                ),
            ),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )  # fmt: skip


def errors_in_half_intervals(outcomes: Sequence[Outcome]) -> Figure:
    """Every error over half its interval, by method; beyond one the interval misses."""
    names = list(outcomes_by_case(outcomes))
    rng = np.random.default_rng(0)
    with drawing_settings():
        canvas = new_canvas(0.8 + 0.4 * len(names))
        axes = canvas.subplots()
        for row, name in enumerate(names):
            method, fault = name.rsplit(", ", 1)
            own = [o for o in outcomes if o.method == method and o.rubs == (fault == "friction")]
            ratios = np.array([abs(o.errors[n]) / o.half_widths[n] for o in own for n in o.errors])
            colours = np.where(ratios > 1, VERMILLION, BLUE)
            jitter = rng.uniform(-0.2, 0.2, len(ratios))
            axes.scatter(np.clip(ratios, 0.01, None), row + jitter, s=12, c=colours, linewidths=0)
        axes.axvline(1.0, color=MUTED, linewidth=0.8)
        axes.set_xscale("log")
        plain_log_ticks(axes, "x")
        axes.set_yticks(range(len(names)), names)
        axes.invert_yaxis()
        axes.set_xlabel("size of the error / half the interval", color=INK)
        return finished(
            canvas,
            "Errors of the parameters over half their intervals: right of the line the interval misses.",
            "One row a method, one dot a parameter of an axis, at its error over half its interval.",
        )
