"""Sections for a controller designer: margins, limit cycles and tracking of the loops."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.design import Design, LoopReport
from bayes_hw.control.limit_cycles import CycleCheck
from bayes_hw.record import Units
from bayes_hw.report.design.figures_control_loop import (
    limit_cycle_check,
    nyquist_and_sensitivities,
    tuned_margins,
)
from bayes_hw.report.design.figures_control_time import time_responses, uncertainty_sets
from bayes_hw.report.page.document import Block, Bullets, Callout, Paragraph, Section, Table
from bayes_hw.report.page.rounding import format_interval, format_number, format_percent, format_value

ARCSEC_PER_DEGREE = 3600.0
LOOPS_A_FIGURE = 3
NYQUIST_SHARE = 0.1
MARGIN_TABLES = (
    (
        (
            ("gain margin (dB)", "gain_margin_db"),
            ("phase margin (deg)", "phase_margin_deg"),
            ("delay margin (s)", "delay_margin_s"),
            ("modulus margin", "modulus_margin"),
        ),
        "Margins; the modulus margin is the smallest |1 + L|.",
    ),
    (
        (
            ("bandwidth (Hz)", "bandwidth_hz"),
            ("crossover (Hz)", "crossover_hz"),
            ("phase crossover (Hz)", "phase_crossover_hz"),
            ("gain may fall by (dB)", "gain_reduction_db"),
        ),
        "The bandwidth is the lowest frequency at which |T| falls below −3 dB, the crossover the lowest at "
        "which |L| falls below one, the phase crossover where the gain margin is taken.",
    ),
)
TRACKING_TABLES = (
    (("step", "ramp"), "Step and ramp; ∞: not settled in 20 s."),
    (
        ("sidereal",),
        "Sidereal tracking. “With noise” adds encoder noise as the posterior has it to what the controller "
        "measures; the error is still that of the axis.",
    ),
)


def margins_section(design: Design) -> Section:
    """Quantiles of every margin, and the loops over frequency."""
    blocks: list[Block] = [nyquist_and_sensitivities(part) for part in _pages(design.loops)]
    blocks += [
        _merit_table(
            design.loops,
            tuple((label, [getattr(loop.margins, name) for loop in design.loops]) for label, name in columns),
            caption,
        )
        for columns, caption in MARGIN_TABLES
    ]
    at_end = [loop.controller.name for loop in design.loops if _taken_at_nyquist(loop) > NYQUIST_SHARE]
    if at_end:
        blocks.append(
            Callout(
                "warn",
                "A gain margin taken at half the sample rate",
                f"{', '.join(at_end)}: in many draws the gain margin is that of the last tenth of the band. "
                "Records seldom excite it, so that the posterior spreads there and the margin with it. A "
                "low pass in the controller takes the question away.",
            )
        )
    if design.sets and any(loop.robustness_peaks for loop in design.loops):
        blocks.append(
            Table(
                ("controller", "order 1", "order 2", "order 3"),
                tuple(
                    (loop.controller.name, *(format_number(peak) for peak in loop.robustness_peaks))
                    for loop in design.loops
                    if loop.robustness_peaks
                ),
                "Largest |W T| over frequency for the multiplicative weights below. Under one, the loop is "
                "stable for every member of the set (small gain), which is more than for every draw.",
                (1, 2, 3),
            )
        )
    return Section("Margins", tuple(blocks))


def cycles_section(design: Design) -> Section:
    """Limit cycles: predicted, simulated, and how often both agree."""
    unit = design.nominal.units.output
    rows = tuple(_cycle_row(loop, check) for loop in design.loops for check in loop.cycles)
    blocks: list[Block] = [
        Paragraph(
            "An oscillation of amplitude A balances where the saturation's and the dead zone's describing "
            "functions take the loop's gain to one at a frequency where L is real and negative. Around zero "
            "of the position both blocks bend; away from it only the limits. Every simulated loop is kicked "
            "at full speed for 2 s and watched for 120 s."
        ),
        Table(
            (
                "controller",
                "place",
                "predicted",
                "simulated",
                "agree",
                "frequency",
                f"amplitude of w ({unit})",
            ),
            rows,
            "Probability of a limit cycle by describing functions and by simulation of the whole nonlinear "
            "loop, share of the simulated draws on which both agree, and medians (predicted / simulated).",
            (2, 3, 4),
        ),
    ]
    shown = tuple(
        loop for loop in design.loops if any(len(check.matched("frequency_hz")[0]) for check in loop.cycles)
    )
    if shown:
        blocks.append(limit_cycle_check(shown, unit))
    else:
        blocks.append(Paragraph("No draw has a limit cycle both predicted and simulated."))
    disagreeing = min(check.agreement for loop in design.loops for check in loop.cycles)
    if disagreeing < 0.9:
        blocks.append(
            Callout(
                "warn",
                "Prediction and simulation differ",
                f"They agree on only {format_percent(disagreeing)} of the draws for one loop. Trust the "
                "simulation: the describing function leaves out the controller's rate limit and "
                "anti-windup, and is rough with few samples a period.",
            )
        )
    return Section("Limit cycles", tuple(blocks))


def tracking_section(design: Design) -> Section:
    """Step, ramp and sidereal tracking."""
    units, signals = design.nominal.units, design.signals
    sidereal = (
        "the output's unit is not an angle, so that there is no sidereal rate"
        if signals.sidereal_rate is None
        else f"sidereal tracking at {format_number(signals.sidereal_rate, 3, f'{units.output}/s')} through "
        "the dead zone"
    )
    scale, unit = error_unit(units)
    blocks: list[Block] = [
        Paragraph(
            f"A step of {format_number(signals.step, 3, units.output)}, a ramp of "
            f"{format_number(signals.ramp_rate, 3, f'{units.output}/s')}, and {sidereal}. Settling is to "
            "within 2 % of the step, for good."
        ),
        *(time_responses(part, units) for part in _pages(design.loops)),
    ]
    first = design.loops[0].responses
    for tests, caption in TRACKING_TABLES:
        columns = []
        for index, response in enumerate(first):
            if response.name not in tests:
                continue
            for name in response.merits:
                is_error = response.units[name] == units.output
                factor, shown = (scale, unit) if is_error else (1.0, response.units[name])
                values = [factor * loop.responses[index].merits[name] for loop in design.loops]
                columns.append((f"{response.name}: {name} ({shown})", values))
        if columns:
            blocks.append(_merit_table(design.loops, tuple(columns), caption))
    return Section("Tracking", tuple(blocks))


def _pages(loops: Sequence[LoopReport]) -> list[Sequence[LoopReport]]:
    """The loops in parts whose figures fit on a page."""
    return [loops[i : i + LOOPS_A_FIGURE] for i in range(0, len(loops), LOOPS_A_FIGURE)]


def error_unit(units: Units) -> tuple[float, str]:
    """Factor and unit in which small errors are shown: arc seconds for degrees."""
    return (ARCSEC_PER_DEGREE, "arcsec") if units.output == "deg" else (1.0, units.output)


def _taken_at_nyquist(loop: LoopReport) -> float:
    """Share of the draws whose gain margin is taken in the last tenth of the controller's band."""
    return float(np.mean(loop.margins.phase_crossover_hz > 0.9 * loop.loop.nyquist_hz))


def _merit_table(
    loops: Sequence[LoopReport],
    columns: Sequence[tuple[str, Sequence[FloatArray]]],
    caption: str,
) -> Table:
    """One row a controller, one column a figure of merit with its draws for every controller."""
    rows = tuple(
        (loop.controller.name, *(_merit_cell(values[i]) for _, values in columns))
        for i, loop in enumerate(loops)
    )
    header = ("controller", *(label for label, _ in columns))
    return Table(header, rows, f"{caption} Median and central 94 % of the draws, unstable ones left out.")


def _cycle_row(loop: LoopReport, check: CycleCheck) -> tuple[str, ...]:
    predicted, simulated = check.predicted, check.simulated
    frequency = _pair(predicted.frequency_hz[predicted.stable], simulated.frequency_hz, "Hz")
    amplitude = _pair(predicted.position_amplitude[predicted.stable], simulated.position_amplitude, "")
    return (
        loop.controller.name,
        check.place,
        format_percent(float(np.mean(predicted.has_cycle)), 1),
        format_percent(float(np.mean(simulated.sustained)), 1),
        format_percent(check.agreement, 1),
        frequency,
        amplitude,
    )


def _pair(predicted: FloatArray, simulated: FloatArray, unit: str) -> str:
    cells = []
    for values in (predicted, simulated):
        finite = values[np.isfinite(values)]
        cells.append(format_number(float(np.median(finite))) if len(finite) else "–")
    return "–" if cells == ["–", "–"] else f"{cells[0]} / {cells[1]} {unit}".strip()


def _merit_cell(values: FloatArray) -> str:
    known = values[~np.isnan(values)]
    if len(known) == 0:
        return "none"
    low, middle, high = np.quantile(known, [0.03, 0.5, 0.97], method="nearest")
    if np.isinf(middle):
        return "∞"
    if np.isinf(high):
        return f"{format_number(middle)} [{format_number(low)}, ∞]"
    if high - low <= 1e-6 * abs(middle):
        return format_number(middle)
    return f"{format_value(middle, (high - low) / 2)} {format_interval(low, high)}"


def sets_section(design: Design) -> Section:
    """The uncertainty sets and the share of fresh draws that they hold."""
    units = design.nominal.units
    rows = []
    for found in design.sets:
        for weight, achieved, interval in zip(found.weights, found.achieved, found.intervals, strict=True):
            numerator, denominator = weight.transfer_function()
            rows.append(
                (
                    found.kind,
                    str(weight.order),
                    format_percent(achieved, 1),
                    format_interval(100 * interval[0], 100 * interval[1]),
                    _polynomial(numerator),
                    _polynomial(denominator),
                )
            )
    lowest = design.sets[0].frequency_hz[0]
    return Section(
        "Uncertainty sets",
        (
            Paragraph(
                f"G = G₀ (1 + W Δ) and G = G₀ + W Δ with |Δ| ≤ 1: the smallest stable W that holds "
                f"{format_percent(design.settings.share)} of the draws at all frequencies from "
                f"{format_number(lowest, 3, 'Hz')} to half the sample rate at once, in the mean of its "
                "logarithm over logarithmic frequency. Draws of an integrator with different gains drift "
                "apart without bound towards zero frequency: no stable additive weight follows them below "
                "the lowest frequency stated."
            ),
            uncertainty_sets(design.sets, units),
            Table(
                ("set", "order", "holds", "95 % interval (%)", "numerator", "denominator"),
                tuple(rows),
                f"Share of {design.sets[0].fresh_draws} fresh draws inside each set, with binomial "
                "intervals, and W in powers of 1/z, constant term first; the additive weight in "
                f"{units.output}/({units.input}). All digits are in design.json.",
                (1, 2, 3),
            ),
        ),
    )


def tuning_section(design: Design) -> Section:
    """Settings over the posterior against those on the point estimate."""
    blocks: list[Block] = []
    for tuning in design.tunings:
        rows = tuple(
            (
                label,
                format_number(tuned.controller.proportional, 4),
                format_number(tuned.controller.integral, 4),
                format_number(tuned.controller.derivative, 4),
                format_number(tuned.lower_bandwidth_hz, 3),
                format_percent(tuned.broken, 1),
            )
            for label, tuned in (
                (f"{tuning.structure} over the posterior", tuning.robust),
                (f"{tuning.structure} on the point estimate", tuning.point),
            )
        )
        blocks.append(
            Table(
                ("settings", "Kp", "Ki (1/s)", "Kd (s)", "5 % bandwidth (Hz)", "break the margins"),
                rows,
                "The settings with the largest lower 5 % bound of bandwidth that keep the margins for "
                f"{format_percent(tuning.share)} of the draws, and those with the largest bandwidth on the "
                f"point estimate alone. Judged on {len(tuning.robust.margins.radius)} fresh draws; Kp in "
                f"({design.nominal.units.input})/{design.nominal.units.output}.",
                (1, 2, 3, 4, 5),
            )
        )
        if not tuning.robust.feasible:
            blocks.append(
                Callout(
                    "bad",
                    "No such settings",
                    "No setting that was tried keeps the margins for so many draws; the best is shown. Ask "
                    "for less, add a filter, or measure what is uncertain.",
                )
            )
        blocks.append(tuned_margins(tuning))
    blocks.append(
        Bullets(
            (
                "Rate, limits, filters and delay are those of the first controller given.",
                "The search asks for two standard errors more than the share, so that fresh draws keep it "
                "too.",
            )
        )
    )
    return Section("Tuning", tuple(blocks))


def _polynomial(coefficients: FloatArray) -> str:
    return ", ".join(format_number(float(c), 4) for c in coefficients)
