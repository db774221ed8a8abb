"""Sections for a controller designer: uncertainty sets, and settings tuned over the posterior."""

from __future__ import annotations

from bayes_hw.arrays import FloatArray
from bayes_hw.control.design import Design
from bayes_hw.report.design.figures_control_loop import tuned_margins
from bayes_hw.report.design.figures_control_time import uncertainty_sets
from bayes_hw.report.page.document import Block, Bullets, Callout, Paragraph, Section, Table
from bayes_hw.report.page.rounding import format_interval, format_number, format_percent


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
