"""The page of an experiment that confirms what a corrected axis has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.gap.answer.axis_with_effects import AxisWithEffects
from bayes_hw.identifiability.confirming_experiment import Experiment, Stage
from bayes_hw.provenance import Provenance
from bayes_hw.report.experiment.figures_experiment import GainBar, PlayedCommand, command, gains
from bayes_hw.report.page.document import Badge, KeyValues, Paragraph, Report, Section
from bayes_hw.report.page.rounding import format_duration, format_interval, format_number, format_percent
from bayes_hw.report.page.typography import typeset

WORTH = 0.9
"""Narrowing from which an experiment tells more than whether the effect is there."""


def confirming_report(
    title: str,
    axis: AxisWithEffects,
    stage: Stage,
    found: Sequence[Experiment],
    narrowing: float,
    provenance: Provenance,
) -> Report:
    """What to play, why, and what it will tell; `narrowing` is the effects' standard deviations after over
    before."""
    first, units, limits = found[0], axis.posterior.axis.model.units, stage.limits
    shrinks = f"to {format_percent(narrowing)} of their width"
    reason = axis.next_experiment
    why = typeset(f" {reason[:1].upper()}{reason[1:]}." if reason else "")
    reached = format_interval(float(first.outputs.min()), float(first.outputs.max()), units.output)
    base, largest = axis.posterior.summaries, float(np.abs(first.u).max())
    return Report(
        title=f"{title}: the experiment that confirms",
        subtitle=f"For an axis with {axis.words}",
        verdict=(
            f"Play {first.label}, {format_duration(len(first.u) / stage.sample_rate_hz)} long: it shows "
            f"whether the axis has {axis.words}, and narrows the intervals of its parameters {shrinks}."
        ),
        badges=(
            Badge(axis.words, "good" if axis.simulated else "warn", "what is to be confirmed"),
            Badge(
                "within what the axis may do",
                "good",
                f"command up to {format_number(largest, 3, units.input)}, angle {reached}",
            ),
            Badge(
                f"intervals {shrinks}",
                "good" if narrowing < WORTH else "warn",
                "of the effect's parameters, expected",
            ),
        ),
        key_figure=command(
            PlayedCommand(
                t=np.arange(len(first.u)) / stage.sample_rate_hz,
                u=first.u,
                outputs=first.outputs,
                velocity_limit=limits.velocity,
                stroke=(limits.lowest, limits.highest),
                believed_limits=(base["saturation.lower"].hdi94, base["saturation.upper"].hdi94),
                input_unit=units.input,
                output_unit=units.output,
            ),
            first.label,
        ),
        sections=(
            Section(
                "Why this one",
                (
                    Paragraph(
                        "It shows this effect and little else, so that who plays it sees it in the record "
                        f"before any fit.{why} Other commands may tell more of its parameters:"
                    ),
                    gains([GainBar(one.label, one.nats, 0.0, one is first) for one in found]),
                ),
            ),
            Section("Where this comes from", (KeyValues(provenance.rows()),), folded=True),
        ),
    )
