"""Sections of the report for a controller designer."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.controller import Controller
from bayes_hw.control.design import Design, LoopReport
from bayes_hw.control.limit_cycles import CycleCheck
from bayes_hw.control.plant_summary import Quantity
from bayes_hw.record import Units
from bayes_hw.report.document import Block, Bullets, Callout, Paragraph, Section, Table
from bayes_hw.report.figures_control_axis import axis_response, crossover_allowance
from bayes_hw.report.figures_control_loop import (
    limit_cycle_check,
    matched_cycles,
    nyquist_and_sensitivities,
    tuned_margins,
)
from bayes_hw.report.figures_control_time import time_responses, uncertainty_sets
from bayes_hw.report.names import parameter_name
from bayes_hw.report.rounding import format_interval, format_number, format_percent, format_value

WORDS = {
    "velocity_gain": "velocity gain",
    "speed.lower": "largest speed, negative",
    "speed.upper": "largest speed, positive",
    "equivalent_delay": "equivalent delay",
}
ARCSEC_PER_DEGREE = 3600.0
MARGIN_ROWS = (
    ("gain margin", "gain_margin_db", "dB"),
    ("gain may fall by", "gain_reduction_db", "dB"),
    ("phase margin", "phase_margin_deg", "deg"),
    ("delay margin", "delay_margin_s", "s"),
    ("modulus margin", "modulus_margin", ""),
    ("bandwidth", "bandwidth_hz", "Hz"),
    ("crossover", "crossover_hz", "Hz"),
    ("phase crossover", "phase_crossover_hz", "Hz"),
)


def axis_section(design: Design) -> Section:
    """Intervals of what the loop depends on, the response of G, its zeros, and where notches must reach."""
    plant, units = design.plant, design.nominal.units
    rows = [_quantity_row(WORDS.get(n) or parameter_name(n).words, q) for n, q in plant.quantities.items()]
    rows += [
        (f"antiresonance {i}", *_draws_cells(pair.frequency_hz, pair.nominal_hz), "Hz")
        for i, pair in enumerate(plant.antiresonances, start=1)
    ]
    rows += [
        (f"damping ratio of antiresonance {i}", *_draws_cells(pair.damping_ratio, pair.nominal_damping), "")
        for i, pair in enumerate(plant.antiresonances, start=1)
    ]
    delay = plant.transport_delay_samples
    blocks: list[Block] = [
        Table(
            ("quantity", "point estimate", "94 % HDI", "unit"),
            tuple(rows),
            f"The axis in numbers. The model's whole delay, {delay} sample{'s' * (delay != 1)} "
            f"({delay / design.nominal.sample_rate_hz:g} s), is held in sampling; the equivalent delay is "
            "the lag of G beyond the 90 deg of its integrator at "
            f"{format_number(plant.equivalent_delay_hz, 3, 'Hz')}, as time.",
            (1, 2),
        ),
        axis_response(plant, design.notches, units),
        Paragraph(
            f"All zeros of G lie inside the unit circle in {format_percent(plant.minimum_phase, 1)} of the "
            "draws."
            + (
                ""
                if plant.minimum_phase == 1
                else " A zero outside cannot be cancelled, and its lag counts in full."
            )
            + (
                " With the other roots of G held, the zeros do not move."
                if design.posterior.axis.free == "dominant"
                else ""
            )
        ),
    ]
    if design.notches:
        blocks.append(
            Table(
                (
                    "resonance",
                    f"{format_percent(design.settings.share)} of the draws",
                    "centre",
                    "damping ratios",
                ),
                tuple(
                    (
                        str(found.mode),
                        format_interval(found.lower_hz, found.upper_hz, "Hz"),
                        format_number(found.notch.frequency_hz, 4, "Hz"),
                        f"{format_number(found.notch.numerator_damping)} over "
                        f"{format_number(found.notch.denominator_damping)}",
                    )
                    for found in design.notches
                ),
                "Where a notch must reach. With these damping ratios of numerator and denominator a notch "
                "in the middle still takes 10 dB off a resonance at either end of its range.",
            )
        )
    else:
        blocks.append(Paragraph("The model has no dominant resonance, so that no notch is called for."))
    return Section("The axis", tuple(blocks))


def crossover_section(design: Design) -> Section:
    """How high a crossover the posterior allows, with and without filters."""
    curves, settings = design.crossovers, design.settings
    allowed = [curve for curve in curves if np.isfinite(curve.allowed_hz)]
    if not allowed:
        text = f"No proportional gain keeps the margins for {format_percent(settings.share)} of the draws."
    else:
        best = max(allowed, key=lambda curve: curve.allowed_hz)
        gain_unit = f"({design.nominal.units.input})/{design.nominal.units.output}"
        text = (
            f"The highest crossover that {format_percent(settings.share)} of the draws allow is "
            f"{format_number(best.allowed_hz, 3, 'Hz')}, with {best.filters} and a proportional gain of "
            f"{format_number(best.allowed_gain, 3, gain_unit)}. A filter that attenuates where the draws "
            "disagree raises it; one whose lag costs more than it attenuates lowers it."
        )
    return Section(
        "The crossover that the intervals allow",
        (Paragraph(text), crossover_allowance(curves, settings.share, settings.requirements.describe())),
    )


def controllers_section(design: Design) -> Section:
    """Settings of every controller, with units."""
    units = design.nominal.units
    gain = f"({units.input})/{units.output}"
    header = ("controller", "rate", f"Kp, {gain}", f"Ki, {gain}/s", f"Kd, {gain} s", "filters", "limits")
    rows = tuple(
        (
            loop.controller.name,
            f"{loop.controller.sample_rate_hz:g} Hz",
            format_number(loop.controller.proportional, 4),
            format_number(loop.controller.integral, 4),
            format_number(loop.controller.derivative, 4),
            _filters(loop.controller),
            _limits(loop.controller, units),
        )
        for loop in design.loops
    )
    return Section(
        "The controllers",
        (
            Table(
                header,
                rows,
                "Controllers in incremental form: increments of P, I and D are added to the remembered "
                "command, which is then limited in rate of change and in size; with plain anti-windup the "
                "limited command is what is remembered.",
                (2, 3, 4),
            ),
        ),
    )


def margins_section(design: Design) -> Section:
    """Quantiles of every margin, and the loops over frequency."""
    requirements = design.settings.requirements
    blocks: list[Block] = [
        Table(
            ("controller", "stable", "margins kept", "at the point estimate"),
            tuple(
                (
                    loop.controller.name,
                    format_percent(loop.probability_stable, 1),
                    format_percent(loop.met(requirements), 1),
                    "kept" if loop.nominal_margins.meets(requirements)[0] else "not kept",
                )
                for loop in design.loops
            ),
            f"Probability over the posterior of stability, and of a {requirements.describe()}.",
            (1, 2),
        ),
        nyquist_and_sensitivities(design.loops),
    ]
    blocks += [_margin_table(loop) for loop in design.loops]
    if design.sets and any(loop.robustness_peaks for loop in design.loops):
        blocks.append(
            Table(
                ("controller", "order 1", "order 2", "order 3"),
                tuple(
                    (loop.controller.name, *(format_number(p) for p in loop.robustness_peaks or [np.nan] * 3))
                    for loop in design.loops
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
        loop
        for loop in design.loops
        if any(len(matched_cycles(check, "frequency_hz")[0]) for check in loop.cycles)
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
        time_responses(design.loops, units),
    ]
    for loop in design.loops:
        rows = []
        for response in loop.responses:
            for name, values in response.merits.items():
                is_error = response.units[name] == units.output
                factor, shown = (scale, unit) if is_error else (1.0, response.units[name])
                rows.append((response.name, name, *_quantile_cells(factor * values), shown))
        blocks.append(
            Table(
                ("test", "quantity", "median", "94 % of the draws", "unit"),
                tuple(rows),
                f"{loop.controller.name}: figures of merit over the draws. “With noise” adds encoder noise "
                "as the posterior has it to what the controller measures; the error is still that of the "
                "axis.",
                (2, 3),
            )
        )
    return Section("Tracking", tuple(blocks))


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
                ("set", "order", "holds", "95 % (%)", "numerator", "denominator"),
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
                "The search asks for a standard error more than the share, so that fresh draws keep it too.",
            )
        )
    )
    return Section("Tuning", tuple(blocks))


def error_unit(units: Units) -> tuple[float, str]:
    """Factor and unit in which small errors are shown: arc seconds for degrees."""
    return (ARCSEC_PER_DEGREE, "arcsec") if units.output == "deg" else (1.0, units.output)


def _quantity_row(words: str, quantity: Quantity) -> tuple[str, ...]:
    low, high = quantity.hdi94
    if quantity.sd == 0:
        return (words, format_number(quantity.nominal, 4), "held", quantity.unit)
    return (words, format_value(quantity.nominal, quantity.sd), format_interval(low, high), quantity.unit)


def _draws_cells(draws: FloatArray, nominal: float) -> tuple[str, str]:
    quantity = Quantity.of(draws, nominal, "")
    if quantity.sd < 1e-9 * abs(quantity.mean):
        return format_number(nominal, 4), "held"
    return format_value(nominal, quantity.sd), format_interval(*quantity.hdi94)


def _margin_table(loop: LoopReport) -> Table:
    rows = []
    for label, name, unit in MARGIN_ROWS:
        draws, nominal = getattr(loop.margins, name), float(getattr(loop.nominal_margins, name)[0])
        finite = draws[np.isfinite(draws)]
        if len(finite) == 0:
            unlimited = bool(np.any(np.isposinf(draws)))
            rows.append((label, "unlimited" if unlimited else "none", "", "", unit))
            continue
        low, middle, high = np.quantile(finite, [0.05, 0.5, 0.95])
        rows.append(
            (
                label,
                format_number(nominal) if np.isfinite(nominal) else "none",
                format_number(middle),
                format_interval(low, high),
                unit,
            )
        )
    return Table(
        ("margin", "point estimate", "median", "5 % to 95 %", "unit"),
        tuple(rows),
        f"{loop.controller.name}: margins of the stable draws. The bandwidth is the lowest frequency at "
        "which |T| falls below −3 dB, the crossover the lowest at which |L| falls below one, the phase "
        "crossover where the gain margin is taken, the modulus margin the smallest |1 + L|.",
        (1, 2, 3),
    )


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


def _quantile_cells(values: FloatArray) -> tuple[str, str]:
    low, middle, high = np.quantile(values, [0.03, 0.5, 0.97], method="nearest")
    if np.isinf(low):
        return "not reached", "not reached"
    if np.isinf(high):
        return (format_number(middle) if np.isfinite(middle) else "not reached"), (
            f"[{format_number(low)}, not reached]"
        )
    return format_number(middle), format_interval(low, high) if high > low else format_number(low)


def _filters(controller: Controller) -> str:
    parts = [f"notch {format_number(notch.frequency_hz, 3, 'Hz')}" for notch in controller.notches]
    if np.isfinite(controller.low_pass_hz):
        parts.append(f"low pass {format_number(controller.low_pass_hz, 3, 'Hz')}")
    if controller.derivative_filter_s > 0:
        parts.append(f"derivative {format_number(controller.derivative_filter_s, 3, 's')}")
    return ", ".join(parts) or "none"


def _limits(controller: Controller, units: Units) -> str:
    parts = []
    if np.isfinite(controller.speed_limit[1]):
        parts.append(f"speed {format_interval(*controller.speed_limit, units.input)}")
    if np.isfinite(controller.rate_of_change_limit):
        parts.append(f"change {format_number(controller.rate_of_change_limit, 3, f'({units.input})/s')}")
    windup = controller.anti_windup_s
    parts.append(
        "plain anti-windup"
        if controller.memory_share == 1
        else "no anti-windup"
        if np.isinf(windup)
        else f"anti-windup {format_number(windup, 3, 's')}"
    )
    if controller.delay_samples:
        parts.append(f"delay {controller.delay_samples} periods")
    return ", ".join(parts)


def _polynomial(coefficients: FloatArray) -> str:
    return ", ".join(format_number(float(c), 4) for c in coefficients)
