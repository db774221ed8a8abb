"""The report on a first hour: a diagnosis with what went before it, and the truth opened at its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from bayes_hw.gap.answer.verdict import Verdict
from bayes_hw.identify.result import RecordFit
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.report.page.document import Block, Callout, Paragraph, Report, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_estimate, format_interval, format_number, format_percent

TITLE = "A first hour with an axis"
SUBTITLE = "Four records and a simulator that is not quite right: what does it lack?"


@dataclass(frozen=True)
class RecordsAlone:
    """What the model identified from the records says: fits on the record held out in per cent, its own and
    that of a linear model, and its parameters by name.
    """

    fit: float
    linear: float
    parameters: Mapping[str, float]

    @classmethod
    def of(cls, model: HammersteinWiener, fit: RecordFit) -> RecordsAlone:
        """Of an identified model and its fit on the record held out."""
        parameters = {
            "saturation.lower": model.saturation.lower,
            "saturation.upper": model.saturation.upper,
            "dead_zone.half_width": model.dead_zone.half_width,
        }
        for number, mode in enumerate(model.dominant_modes, 1):
            parameters[f"mode{number}.frequency_hz"] = mode.frequency_hz
            parameters[f"mode{number}.damping_ratio"] = mode.damping_ratio
        return cls(fit.hammerstein_wiener, fit.linear, parameters)


@dataclass(frozen=True)
class Truth:
    """What was simulated: labels of the effects, their forms, and the base parameters by name."""

    labels: Sequence[str]
    forms: Sequence[str]
    base: Mapping[str, float]


def first_hour_report(diagnosis: Report, verdict: Verdict, alone: RecordsAlone, truth: Truth) -> Report:
    """The report of the diagnosis between what an engineer has and what only the simulation knows."""
    *findings, origin = diagnosis.sections
    return replace(
        diagnosis,
        title=TITLE,
        subtitle=SUBTITLE,
        sections=(_before(alone), *findings, _truth_section(verdict, alone, truth), origin),
    )


def _before(alone: RecordsAlone) -> Section:
    frequency = alone.parameters.get("mode1.frequency_hz")
    mode = "" if frequency is None else f", and puts the first mode at {format_number(frequency, 4)} Hz"
    return Section(
        "What lies on the table",
        (
            Paragraph(
                "An axis simulated at torque level, with motor, velocity loop, gear, load and structure. An "
                "engineer has three training records and one held out, commands and encoder angles, and a "
                "simulator whose numbers are a few percent off and which lacks one effect. Which one is not "
                "told until the last section."
            ),
            Paragraph(
                f"The first thought is to fit a model to the records alone. It explains "
                f"{format_number(alone.fit)} % of the record held out, a linear one "
                f"{format_number(alone.linear)} %{mode}. That looks good, and it is where one might stop. "
                "The next section asks what is left: is it noise?"
            ),
        ),
    )


def _truth_section(verdict: Verdict, alone: RecordsAlone, truth: Truth) -> Section:
    right = sorted(verdict.answer) == sorted(truth.labels)
    said = " and ".join(verdict.answer) or "no structural gap"
    rows = []
    held = 0
    for name, value in truth.base.items():
        if name not in verdict.base:
            continue
        found = verdict.base[name]
        inside = found.hdi94[0] <= value <= found.hdi94[1]
        held += inside
        before = alone.parameters.get(name)
        rows.append(
            (
                parameter_name(name).words,
                f"{format_number(value, 4)} {found.unit}".strip(),
                "" if before is None else format_number(before, 4),
                format_estimate(found.mean, found.sd),
                format_interval(*found.hdi94),
                "yes" if inside else "NO",
            )
        )
    blocks: tuple[Block, ...] = (
        Callout(
            "good" if right else "bad",
            "Right" if right else "Not right this time",
            f"The answer was {said}; the truth is {', '.join(truth.forms)}.",
        ),
        Table(
            ("parameter", "truth", "model from records alone", "with the effect added", "94 %", "holds"),
            tuple(rows),
            f"The simulator's own numbers. {held} of {len(rows)} intervals hold the truth, where "
            f"{format_percent(0.94)} of many should.",
            (1, 2, 3, 4),
        ),
    )
    return Section("The truth, opened", blocks)
