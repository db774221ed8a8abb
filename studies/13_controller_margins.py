"""The Nanshan 26 m twin for a controller designer: which margins, limit cycles and settings hold over the
posterior?

The twin's records (study 02) are identified and sampled with all of G free. Four PI controllers at 20 Hz, a
sweep of the gain through the critical one, and PI and PID settings tuned over the posterior and on the point
estimate alone. The twin's true axis, which nothing here has seen, says afterwards whether the intervals of
the margins hold it. Writes report.html, report.pdf and results.json.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from pages.figures_control_sweep import GainStep, cycle_probability
from study import start_study
from twin import twin_records

from bayes_hw.analysis import identify_with_progress
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.design import Design, DesignSettings, LoopReport, design
from bayes_hw.control.export import design_content
from bayes_hw.control.limit_cycles import PLACES, check_cycles
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Requirements, loop_margins
from bayes_hw.infer.inference import infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.report.design.design_report import design_report
from bayes_hw.report.page.document import Block, Paragraph, Section, Table
from bayes_hw.report.page.rounding import format_interval, format_number, format_percent

PLAIN = Controller("PI", 20.0, 40.0, 10.0, low_pass_hz=4.0)
CONTROLLERS = (
    PLAIN,
    Controller("PI without low pass", 20.0, 25.0, 5.0),
    Controller("PI at the edge", 20.0, 88.0, 5.0, low_pass_hz=4.0),
    replace(
        PLAIN,
        name="PI with limits of its own",
        speed_limit=(-0.3, 0.3),
        rate_of_change_limit=0.5,
        anti_windup_s=1.0,
    ),
)
"""Gains in (deg/s)/deg and (deg/s)/deg/s, limits in deg/s and (deg/s)/s."""

SWEEP = (0.85, 0.95, 0.97, 0.98, 0.99, 1.0, 1.01, 1.02, 1.03, 1.05, 1.15)
CHECKED = {"gain margin": "gain_margin_db", "phase margin": "phase_margin_deg", "bandwidth": "bandwidth_hz"}
UNITS = {"gain margin": "dB", "phase margin": "deg", "bandwidth": "Hz"}
PLACE = PLACES[0]


def main() -> None:
    study = start_study("13_controller_margins", __doc__)
    data_rng, _, sample_rng, design_rng = np.random.default_rng(study.seed).spawn(4)
    twin = twin_records(data_rng)
    if study.quick:
        model = twin.truth
    else:
        model = identify_with_progress(twin.train, "Nanshan 26 m twin, azimuth", "rest", study.progress).model
    inference = infer(
        model,
        twin.train[:1] if study.quick else twin.train,
        sample_rng,
        free="dominant" if study.quick else "all",
        settings=SamplerSettings(max_steps=100 if study.quick else 3000),
        jobs=study.jobs,
        progress=study.progress,
    )
    settings = DesignSettings(
        requirements=Requirements(6.0, 45.0, 1 / model.sample_rate_hz), tuned=("PI", "PID")
    )
    if study.quick:
        settings = replace(settings, draws=150, search_draws=30, simulated_draws=30, tuned=("PI",))
    controllers = CONTROLLERS[:2] if study.quick else CONTROLLERS
    found = design(inference.posterior, controllers, design_rng, settings=settings, progress=study.progress)
    sweep = gain_sweep(found, SWEEP[::5] if study.quick else SWEEP)
    truth = truth_check(found, twin.truth)
    seconds = seconds_for_margins(found)
    report = design_report(found, study.origin(twin.train))
    sections = [*report.sections[:-2], sweep_section(sweep), truth_section(truth), *report.sections[-2:]]
    study.write_document(replace(report, sections=tuple(sections)))
    study.write_results(
        {
            **results(found),
            "gain_sweep": [asdict(step) for step in sweep],
            "truth": truth,
            "margin_draws": found.axis.count,
            "seconds_for_margins": seconds,
        }
    )
    for tuning in found.tunings:
        print(
            f"{tuning.structure}: point estimate breaks margins for {100 * tuning.point.broken:.1f} % of the "
            f"draws, posterior for {100 * tuning.robust.broken:.1f} %"
        )
    print(f"margins of {found.axis.count} draws in {seconds:.2f} s")


def gain_sweep(found: Design, relative_gains: Sequence[float]) -> list[GainStep]:
    """Limit cycles of the first controller with its gains multiplied through the critical gain."""
    first = found.loops[0]
    critical = 10 ** (float(first.nominal_margins.gain_margin_db[0]) / 20)
    few = found.axis.take(np.arange(min(found.settings.simulated_draws, found.axis.count)))
    steps = []
    for relative in relative_gains:
        factor = critical * relative
        hot = replace(
            first.controller,
            proportional=factor * first.controller.proportional,
            integral=factor * first.controller.integral,
        )
        loop = Loop(few, hot)
        check = check_cycles(loop, few.count)[PLACES.index(PLACE)]
        steps.append(
            GainStep(
                relative,
                float(np.mean(loop.spectral_radius() > 1)),
                float(np.mean(check.predicted.has_cycle)),
                float(np.mean(check.simulated.sustained)),
                check.agreement,
            )
        )
    return steps


def truth_check(found: Design, truth: HammersteinWiener) -> list[dict[str, Any]]:
    """Margins of the true axis beside the central 94 % of the draws, for every controller."""
    parameters = AxisParameters(truth)
    axis = AxisDraws.of_values(parameters, parameters.nominal[:, None])
    entries = []
    for loop in found.loops:
        true = loop_margins(Loop(axis, loop.controller))
        for words, name in CHECKED.items():
            draws = getattr(loop.margins, name)
            value = float(getattr(true, name)[0])
            low, high = np.quantile(draws[np.isfinite(draws)], [0.03, 0.97])
            entries.append(
                {
                    "controller": loop.controller.name,
                    "margin": words,
                    "unit": UNITS[words],
                    "truth": value if np.isfinite(value) else None,
                    "interval94": [float(low), float(high)],
                    "inside": bool(low <= value <= high),
                }
            )
    return entries


def seconds_for_margins(found: Design) -> float:
    """Wall time of the margins of all draws, the grid and the responses included."""
    begin = time.perf_counter()
    loop_margins(Loop(found.axis, found.loops[0].controller))
    return time.perf_counter() - begin


def sweep_section(steps: Sequence[GainStep]) -> Section:
    rows = tuple(
        (
            format_number(step.relative_gain, 3),
            format_percent(step.unstable, 1),
            format_percent(step.predicted, 1),
            format_percent(step.simulated, 1),
            format_percent(step.agreement, 1),
        )
        for step in steps
    )
    blocks: tuple[Block, ...] = (
        cycle_probability(steps, PLACE),
        Table(
            ("gain / critical", "linear loop unstable", "predicted", "simulated", "agree"),
            rows,
            f"{PLAIN.name} with both gains multiplied; critical is the gain at which the point estimate "
            "loses stability. Within a per cent of it oscillations grow or die so slowly that two minutes "
            "do not tell.",
            (0, 1, 2, 3, 4),
        ),
    )
    return Section("Limit cycles as the gain rises", blocks)


def truth_section(truth: Sequence[dict[str, Any]]) -> Section:
    inside = sum(entry["inside"] for entry in truth)
    rows = tuple(
        (
            entry["controller"],
            f"{entry['margin']} ({entry['unit']})",
            "unstable" if entry["truth"] is None else format_number(entry["truth"], 4),
            format_interval(*entry["interval94"]),
            "yes" if entry["inside"] else "no",
        )
        for entry in truth
    )
    return Section(
        "The true axis",
        (
            Paragraph(
                f"The twin's true axis is known. Of its {len(truth)} margins {inside} lie in the central 94 "
                "% of the posterior draws; they are not independent of each other."
            ),
            Table(
                ("controller", "margin", "truth", "94 % of the draws", "inside"),
                rows,
                "Margins of the true axis, which neither identification nor tuning has seen.",
                (2, 3),
            ),
        ),
    )


def results(found: Design) -> dict[str, Any]:
    """What design.json holds, without draws and curves."""
    content = design_content(found)
    del content["draws"], content["nominal"], content["axis"]["response"]
    content["loops"] = [
        {**entry, "met_at_point_estimate": met(loop, found)}
        for entry, loop in zip(content["loops"], found.loops, strict=True)
    ]
    return content


def met(loop: LoopReport, found: Design) -> bool:
    return bool(loop.nominal_margins.meets(found.settings.requirements)[0])


if __name__ == "__main__":
    main()
