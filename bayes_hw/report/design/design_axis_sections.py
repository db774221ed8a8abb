"""Sections for a controller designer: the axis, the crossover it allows, the controllers."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.controller import Controller
from bayes_hw.control.design import Design
from bayes_hw.control.plant_summary import Quantity
from bayes_hw.record import Units
from bayes_hw.report.design.figures_control_axis import axis_response, crossover_allowance
from bayes_hw.report.page.document import Block, Paragraph, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_interval, format_number, format_percent, format_value

WORDS = {
    "velocity_gain": "velocity gain",
    "speed.lower": "largest speed, negative",
    "speed.upper": "largest speed, positive",
    "equivalent_delay": "equivalent delay",
}


def axis_section(design: Design) -> Section:
    """Intervals of what the loop depends on, the response of G, its zeros, and where notches must reach."""
    plant, units = design.plant, design.nominal.units
    rows = [
        _quantity_row(WORDS.get(n) or parameter_name(n).words, q, n in plant.unreached)
        for n, q in plant.quantities.items()
    ]
    rows += [
        (f"antiresonance {i}", *_draws_cells(pair.frequency_hz, pair.nominal_hz), "Hz")
        for i, pair in enumerate(plant.antiresonances, start=1)
    ]
    rows += [
        (f"damping ratio of antiresonance {i}", *_draws_cells(pair.damping_ratio, pair.nominal_damping), "")
        for i, pair in enumerate(plant.antiresonances, start=1)
    ]
    blocks: list[Block] = [
        Table(
            ("quantity", "point estimate", "94 % HDI", "unit"),
            tuple(rows),
            f"The axis in numbers. {_delay_in_words(design)} The equivalent delay is "
            "the lag of G beyond the 90 deg of its integrator at "
            f"{format_number(plant.equivalent_delay_hz, 3, 'Hz')}, as time."
            + (
                " A limit that is “beyond” was met by no command of the records: its interval is the prior's."
                if plant.unreached
                else ""
            ),
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
                if design.posterior.axis.free == "conditional"
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
    blocks: list[Block] = [Paragraph(text)]
    if any(np.any(curve.crossover_hz > 0) for curve in curves):
        blocks.append(crossover_allowance(curves, settings.share, settings.requirements.describe()))
    return Section("The crossover that the intervals allow", tuple(blocks))


def controllers_section(design: Design) -> Section:
    """Settings of every controller, with units."""
    units = design.nominal.units
    gain = f"({units.input})/{units.output}"
    header = (
        "controller",
        "rate",
        f"Kp, {gain}",
        f"Ki, {gain}/s",
        f"Kd, {gain} s",
        "filters",
        "limits and memory",
    )
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
                "command, which is then limited in rate of change and in size. Where no more is said, the "
                "limited command is what is remembered; back-calculation forgets the excess in the time "
                "given.",
                (2, 3, 4),
            ),
        ),
    )


def _delay_in_words(design: Design) -> str:
    """The whole delay of the model: what it has as dead time, and the sample that a held command takes."""
    own = design.posterior.axis.model.linear.delay_samples
    held = design.plant.transport_delay_samples - own
    step = 1 / design.nominal.sample_rate_hz
    return (
        f"The model's dead time, {own} sample{'s' * (own != 1)} ({own * step:g} s) beside the {held} that a "
        "command held from sample to sample takes to show, is held in sampling."
    )


def _quantity_row(words: str, quantity: Quantity, unreached: bool) -> tuple[str, ...]:
    low, high = quantity.hdi94
    if unreached:
        beyond = min((low, high), key=abs)
        return (words, f"beyond {format_number(beyond, 3)}", format_interval(low, high), quantity.unit)
    if quantity.sd == 0:
        return (words, format_number(quantity.nominal, 4), "held", quantity.unit)
    return (words, format_value(quantity.nominal, quantity.sd), format_interval(low, high), quantity.unit)


def _draws_cells(draws: FloatArray, nominal: float) -> tuple[str, str]:
    quantity = Quantity.of(draws, nominal, "")
    if quantity.sd < 1e-9 * abs(quantity.mean):
        return format_number(nominal, 4), "held"
    return format_value(nominal, quantity.sd), format_interval(*quantity.hdi94)


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
        parts.append(f"{format_interval(*controller.speed_limit)} {units.input}")
    if np.isfinite(controller.rate_of_change_limit):
        parts.append(f"{format_number(controller.rate_of_change_limit)} ({units.input})/s")
    if controller.memory_share < 1:
        windup = controller.anti_windup_s
        parts.append("winds up" if np.isinf(windup) else f"back-calculation {format_number(windup, 3, 's')}")
    if controller.delay_samples:
        parts.append(f"delay {controller.delay_samples} periods")
    return ", ".join(parts) or "plain"
