"""The report on a transfer function printed with few digits: what they determine, and what not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from printed.rounding_box import RoundingBox, RoundingUncertainty, StableShare

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.provenance import Provenance
from bayes_hw.record import Units
from bayes_hw.report.page.document import (
    Badge,
    Bullets,
    Callout,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
)
from bayes_hw.report.page.rounding import format_estimate, format_interval, format_number, format_percent
from pages.figures_printed_model import PoleClouds, pole_map, velocity_gain_band

SHOWN_MEMBERS = 300
CENTRAL = (0.03, 0.97)
"""Ends of the central 94 % of the members of the box."""

TIGHT = 0.01
"""A resonance is tight when 94 % of the members agree on its frequency to this share of it."""


@dataclass(frozen=True, eq=False)
class Choice:
    """The representative that another limit on the slow poles gives, or why there is none."""

    limit: float
    block: LinearBlock | None
    largest_displacement: float
    refused: str = ""


@dataclass(frozen=True, eq=False)
class PrintedModel:
    """Everything that the report says.

    `readings` are what rounding leaves uncertain, by the reading of the digits; the first is the one that
    the text speaks of. `box_poles` (members, n) are those of members of the whole box, `printed_poles` (n,)
    those of the digits as they stand.
    """

    box: RoundingBox
    printed_poles: ComplexArray
    box_poles: ComplexArray
    representative: LinearBlock
    modes: tuple[Mode, ...]
    slow_pole_limit: float
    choices: tuple[Choice, ...]
    readings: dict[str, RoundingUncertainty]
    sample_rate_hz: float
    units: Units

    @property
    def spread(self) -> RoundingUncertainty:
        return next(iter(self.readings.values()))

    @property
    def gain_unit(self) -> str:
        return self.units.velocity_gain


def printed_model_report(model: PrintedModel, provenance: Provenance) -> Report:
    """The report whose first page answers: what do the printed digits determine?"""
    return Report(
        title="The printed model of the Nanshan 26 m telescope",
        subtitle="What a transfer function printed with four digits a coefficient still says",
        verdict=_verdict(model),
        badges=_badges(model),
        key_figure=pole_map(
            PoleClouds(
                model.box_poles[:SHOWN_MEMBERS],
                model.spread.poles[:SHOWN_MEMBERS],
                model.printed_poles,
                model.representative.poles,
            )
        ),
        sections=(
            _rounding_section(model),
            _representative_section(model),
            _limits_section(),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(model: PrintedModel) -> str:
    spread = model.spread
    largest = float(np.abs(model.printed_poles).max())
    frequencies = " and ".join(_central(column, "Hz") for column in spread.frequency_hz.T)
    negative = float(np.mean(spread.velocity_gain < 0))
    return (
        f"As printed the model diverges: a pole lies at modulus {format_number(largest, 5)}. That is "
        f"rounding, not the telescope: {_share(spread.stable_in_box)} of the transfer functions that round "
        f"to the printed digits are stable, and {_share(spread.stable_integrators)} of those with an exact "
        f"integrator. The digits determine the resonances, {frequencies} (94 % of the box), and the "
        f"velocity gain at 1 Hz, {_central(_gain_at(model, 1.0), model.gain_unit)}. They do not determine "
        f"the gain at zero frequency, {_central(spread.velocity_gain, model.gain_unit)}: it is negative in "
        f"{format_percent(negative)} of the stable integrators, so even its sign is open. The "
        "representative kept here is a choice inside the box, stated below."
    )


def _badges(model: PrintedModel) -> tuple[Badge, ...]:
    spread = model.spread
    displacement = float(np.abs(np.concatenate(_displacement(model))).max())
    widths = [np.ptp(np.quantile(column, CENTRAL)) / np.median(column) for column in spread.frequency_hz.T]
    low, high = np.quantile(spread.velocity_gain, CENTRAL)
    sign_open = low < 0 < high
    stable_as_printed = float(np.abs(model.printed_poles).max()) < 1
    return (
        Badge(
            "stable as printed" if stable_as_printed else "diverges as printed",
            "good" if stable_as_printed else "bad",
            f"largest pole modulus {format_number(float(np.abs(model.printed_poles).max()), 5)}",
        ),
        Badge(
            "resonances tight" if max(widths) < TIGHT else "resonances loose",
            "good" if max(widths) < TIGHT else "warn",
            f"94 % of the members agree to {format_percent(float(max(widths)), 1)} or better",
        ),
        Badge(
            "sign of gain open" if sign_open else "sign of gain known",
            "warn" if sign_open else "good",
            f"zero-frequency velocity gain {format_interval(float(low), float(high))}",
        ),
        Badge(
            "representative inside" if displacement <= 1 else "representative outside",
            "good" if displacement <= 1 else "bad",
            f"farthest coefficient {format_number(displacement)} half widths from the printed one",
        ),
    )


def _rounding_section(model: PrintedModel) -> Section:
    rows = []
    for label, spread in model.readings.items():
        rows += [
            (label, "stable, of the whole box", _share(spread.stable_in_box), ""),
            (label, "stable, of those with a pole at z = 1", _share(spread.stable_integrators), ""),
            *(
                (label, f"frequency of resonance {i}", *_ranges(column, "Hz"))
                for i, column in enumerate(spread.frequency_hz.T, start=1)
            ),
            *(
                (label, f"damping ratio of resonance {i}", *_ranges(column, ""))
                for i, column in enumerate(spread.damping_ratio.T, start=1)
            ),
            (label, "velocity gain at 1 Hz", *_ranges(_gain_at(model, 1.0, label), model.gain_unit)),
            (label, "velocity gain at zero frequency", *_ranges(spread.velocity_gain, model.gain_unit)),
        ]
    first = model.spread
    order = np.argsort(first.gain_frequency_hz)
    frequency = first.gain_frequency_hz[order]
    kept = np.abs(model.representative.frequency_response(frequency, model.sample_rate_hz))
    return Section(
        "What rounding leaves uncertain",
        (
            Paragraph(
                "Every coefficient is known to half a unit of its last digit. Transfer functions are drawn "
                "uniformly from that box; resonances and gains are those of the stable ones with an exact "
                f"integrator ({first.stable_integrators.stable} of {first.stable_integrators.draws} draws). "
                "The paper does not say whether short numbers (0.0159, −0.486) lost a trailing zero, so "
                "both readings are shown."
            ),
            Table(
                ("reading", "quantity", "94 % of the members", "all members"),
                tuple(rows),
                "What the printed digits leave open. Shares with their binomial standard error; ranges are "
                "not posterior intervals, since nothing was measured: all members fit the print equally "
                "well.",
                (2, 3),
            ),
            velocity_gain_band(
                frequency, first.gain_curve[:, order], kept * 2 * np.pi * frequency, model.gain_unit
            ),
        ),
    )


def _representative_section(model: PrintedModel) -> Section:
    numerator, denominator = model.representative.coefficients()
    moved = _displacement(model)
    printed = (model.box.numerator, model.box.denominator)
    rows = tuple(
        (
            f"{symbol}{power}",
            f"{old:g}".replace("-", "−"),
            format_number(float(new), 7),
            format_number(float(step), 2),
        )
        for symbol, olds, news, steps in zip("ba", printed, (numerator, denominator), moved, strict=True)
        for power, (old, new, step) in enumerate(zip(olds, news, steps, strict=True))
        if old not in (0, 1)
    )
    modes = ", ".join(
        f"{format_number(mode.frequency_hz, 5)} Hz (damping ratio {format_number(mode.damping_ratio)})"
        for mode in model.modes
    )
    gain = format_number(model.representative.velocity_gain(model.sample_rate_hz), 5, model.gain_unit)
    return Section(
        "The stable representative",
        (
            Bullets(
                (
                    "A(1) = 0 exactly: a velocity command moves the angle for good.",
                    f"The two slow poles next to the integrator have modulus {model.slow_pole_limit:g} or "
                    "less.",
                    "The velocity gain at zero frequency equals its plateau above the slow poles, which "
                    "settles the sign that rounding leaves open.",
                    "Of all members that meet these, it is the one nearest to the printed coefficients, in "
                    "the sum of squared displacements in half widths.",
                )
            ),
            Paragraph(f"Its resonances are at {modes}; its velocity gain is {gain}."),
            Table(
                ("coefficient", "printed", "representative", "displacement (half widths)"),
                rows,
                "Uncertain coefficients of powers of 1/z, numerator b and denominator a. Inside the box a "
                "displacement is at most one in magnitude.",
                (1, 2, 3),
            ),
            Table(
                ("limit of slow poles", "farthest coefficient", "resonances", "velocity gain"),
                tuple(_choice_row(choice, model) for choice in model.choices),
                "What another limit on the slow poles, the one free number of the choice, would have given. "
                f"Kept: {model.slow_pole_limit:g}.",
                (0, 1, 2, 3),
            ),
        ),
    )


def _choice_row(choice: Choice, model: PrintedModel) -> tuple[str, ...]:
    limit = f"{choice.limit:g}"
    if choice.block is None:
        return (limit, "none", "", "")
    found = choice.block.modes(model.sample_rate_hz)
    light = [mode for mode in found if mode.damping_ratio < 2 * max(m.damping_ratio for m in model.modes)]
    return (
        limit,
        format_number(choice.largest_displacement),
        ", ".join(format_number(mode.frequency_hz, 5) for mode in light) + " Hz",
        format_number(choice.block.velocity_gain(model.sample_rate_hz), 5),
    )


def _limits_section() -> Section:
    return Section(
        "What this does not show",
        (
            Callout(
                "warn",
                "A choice, not an estimate",
                "The representative is one stable reading of printed digits. It is the plant of the twin and "
                "says nothing about the telescope beyond what the table above calls determined.",
            ),
            Bullets(
                (
                    "The dead zone's half width and the noise are not printed; the twin's are chosen.",
                    "Uniform draws weight all members alike; the shares are those of the box's volume, not "
                    "probabilities about the telescope.",
                )
            ),
        ),
    )


def _displacement(model: PrintedModel) -> tuple[FloatArray, FloatArray]:
    return model.box.displacement(*model.representative.coefficients())


def _gain_at(model: PrintedModel, frequency_hz: float, reading: str = "") -> FloatArray:
    spread = model.readings[reading] if reading else model.spread
    return spread.gain_curve[:, int(np.argmin(np.abs(spread.gain_frequency_hz - frequency_hz)))]


def _central(values: FloatArray, unit: str) -> str:
    low, high = np.quantile(values, CENTRAL)
    return format_interval(float(low), float(high), unit)


def _ranges(values: FloatArray, unit: str) -> tuple[str, str]:
    return _central(values, unit), format_interval(float(values.min()), float(values.max()), unit)


def _share(counted: StableShare) -> str:
    return format_estimate(100 * counted.share, 100 * counted.standard_error, "%")
