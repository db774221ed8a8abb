"""The report of the study of interval widths: what longer, larger and other commands gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import Badge, Block, Bullets, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_number, format_percent
from bayes_hw.report.page.typography import typeset
from pages.figures_interval_width import WidthCurve, widths_by_kind, widths_by_setting

IDENTIFIED, WEAK, PRIOR = "identified", "weakly identified", "prior-dominated"
NEAR_EXPECTED = 0.15
"""A slope over length this near to -1/2 follows the law of 1/sqrt(length)."""


@dataclass(frozen=True)
class ParameterWidth:
    """Half the 94 % interval, the true value, and the verdict on the parameter with its reason."""

    half_width: float
    truth: float
    verdict: str
    reason: str

    @property
    def relative(self) -> float:
        """Half the interval over the size of the true value."""
        return self.half_width / abs(self.truth)


@dataclass(frozen=True)
class Experiment:
    """One experiment of the series "length" (setting in s), "amplitude" (setting in deg/s) or "kind".

    `in_dead_zone` is the share of its samples, without noise, that lie in the dead zone.
    """

    series: str
    label: str
    setting: float
    command_range: tuple[float, float]
    in_dead_zone: float
    converged: bool
    widths: dict[str, ParameterWidth]


def slope_over_length(experiments: Sequence[Experiment], parameter: str) -> float:
    """Least-squares slope of log half width over log length."""
    chosen = [each for each in experiments if each.series == "length"]
    lengths = np.log([each.setting for each in chosen])
    widths = np.log([each.widths[parameter].half_width for each in chosen])
    return float(np.polyfit(lengths, widths, 1)[0])


def interval_width_report(
    experiments: Sequence[Experiment], limits: tuple[float, float], provenance: Provenance, *, length_s: float
) -> Report:
    """The report whose first page shows the widths over length and amplitude."""
    names = tuple(experiments[0].widths)
    slopes = {name: slope_over_length(experiments, name) for name in names}
    usual = [name for name in names if abs(slopes[name] + 0.5) <= NEAR_EXPECTED]
    prior = [
        (each, name) for each in experiments for name, width in each.widths.items() if width.verdict == PRIOR
    ]
    kinds = {
        each.label: {
            parameter_name(n).symbol: (w.relative, w.verdict == PRIOR) for n, w in each.widths.items()
        }
        for each in experiments
        if each.series == "kind"
    }
    blocks: tuple[Block, ...] = (_table(experiments, "kind"),)
    if kinds:
        blocks = (widths_by_kind(kinds), *blocks)
    return Report(
        title="How intervals shrink",
        subtitle="Nanshan 26 m twin: half the 94 % interval over length, amplitude and kind of the command",
        verdict=_verdict(names, slopes, usual, prior),
        badges=(
            Badge(
                "1/sqrt(length)",
                "good" if len(usual) == len(names) else "warn",
                f"slopes {format_number(min(slopes.values()), 2)} to {format_number(max(slopes.values()), 2)}"
                " over length; -0.5 is expected".replace("-0.5", "−0.5"),
            ),
            Badge(
                "records decide",
                "warn" if prior else "good",
                f"{len(prior)} of {len(experiments) * len(names)} intervals are the prior's",
            ),
            Badge(
                "converged",
                "good" if all(each.converged for each in experiments) else "warn",
                f"{sum(each.converged for each in experiments)} of {len(experiments)} experiments",
            ),
        ),
        key_figure=widths_by_setting(
            _curves(experiments, "length"), _curves(experiments, "amplitude"), limits
        ),
        sections=(
            Section(
                "Length",
                (
                    _slopes(names, slopes),
                    _table(experiments, "length"),
                    Paragraph(
                        "An error of a limit or of the gain becomes a drift that grows with the length of the"
                        " record; where that drift is seen, an interval shrinks faster than 1/sqrt(length)."
                    ),
                ),
            ),
            Section(
                "Amplitude",
                (
                    _table(experiments, "amplitude"),
                    Paragraph(
                        "Below a limit the command says nothing about it: its interval is the prior's."
                        " Sweeps that reach no limit swing about the start, much of the time in the dead zone"
                        " (last column), which hides the small motion at the modes; beyond a limit a drift"
                        " carries the axis out of it, and modes and gain are seen."
                    ),
                ),
            ),
            Section("Kind of command", blocks),
            Section("What the records leave to the prior", (_reasons(prior),)),
            Section(
                "How it was found",
                (
                    Bullets(
                        (
                            "Two records an experiment, with constants that send them to either side of"
                            " zero; all have the twin's noise, whatever the amplitude.",
                            f"Amplitudes and kinds at {length_s:g} s a record.",
                            "Other roots of G are held at the truth; with all of G free intervals are wider.",
                        )
                    ),
                ),
            ),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(
    names: Sequence[str],
    slopes: dict[str, float],
    usual: Sequence[str],
    prior: Sequence[tuple[Experiment, str]],
) -> str:
    text = (
        f"Intervals shrink as one over the square root of the length for {len(usual)} of {len(names)}"
        f" parameters (slope within {NEAR_EXPECTED:g} of −0.5)."
    )
    others = [f"{parameter_name(n).words} {format_number(slopes[n], 2)}" for n in names if n not in usual]
    if others:
        text += f" Others: {', '.join(others)}."
    if not prior:
        return f"{text} No interval is left to its prior."
    named: dict[str, list[Experiment]] = {}
    for each, name in prior:
        named.setdefault(parameter_name(name).symbol, []).append(each)
    left = "; ".join(f"{symbol} {_where(found)}" for symbol, found in named.items())
    return f"{text} More data of the same kind would not help where the prior decides: {left}."


def _where(experiments: Sequence[Experiment]) -> str:
    """Up to which amplitude, and in which other experiments."""
    amplitudes = [each.setting for each in experiments if each.series == "amplitude"]
    places = [f"up to {format_number(max(amplitudes), 1, 'deg/s')}"] if amplitudes else []
    places += [f"({each.series} {each.label})" for each in experiments if each.series != "amplitude"]
    return " and ".join(places)


def _curves(experiments: Sequence[Experiment], series: str) -> tuple[WidthCurve, ...]:
    chosen = [each for each in experiments if each.series == series]
    return tuple(
        WidthCurve(
            parameter_name(name).symbol,
            np.array([each.setting for each in chosen]),
            np.array([each.widths[name].relative for each in chosen]),
            np.array([each.widths[name].verdict == PRIOR for each in chosen]),
        )
        for name in experiments[0].widths
    )


def _slopes(names: Sequence[str], slopes: dict[str, float]) -> Table:
    return Table(
        ("parameter", "slope over length"),
        tuple((parameter_name(name).words, format_number(slopes[name], 2)) for name in names),
        "Slope of the logarithm of the half width over that of the length; −0.5 is expected where records"
        " add up.",
        (1,),
    )


def _table(experiments: Sequence[Experiment], series: str) -> Table:
    names = tuple(experiments[0].widths)
    return Table(
        (series, *(parameter_name(name).symbol for name in names), "in dead zone"),
        tuple(
            (each.label, *(_cell(each.widths[name]) for name in names), format_percent(each.in_dead_zone))
            for each in experiments
            if each.series == series
        ),
        "Half the 94 % interval as a share of the true value; (w) weakly identified, (p) prior-dominated."
        " Last, the share of samples in the dead zone.",
        tuple(range(1, len(names) + 2)),
    )


def _cell(width: ParameterWidth) -> str:
    mark = {WEAK: " (w)", PRIOR: " (p)"}.get(width.verdict, "")
    decimals = 2 if width.relative < 0.01 else 1 if width.relative < 0.1 else 0
    return format_percent(width.relative, decimals).replace("\u00a0%", "\u202f%") + mark


def _reasons(prior: Sequence[tuple[Experiment, str]]) -> Block:
    if not prior:
        return Paragraph("Nothing: every parameter is identified or weakly identified in every experiment.")
    return Table(
        ("experiment", "command (deg/s)", "parameter", "why"),
        tuple(
            (
                f"{each.series}: {each.label}",
                " to ".join(format_number(end, 2) for end in each.command_range),
                parameter_name(name).words,
                typeset(each.widths[name].reason),
            )
            for each, name in prior
        ),
        "Every prior-dominated parameter, the range of the command, and the reason of the verdict.",
    )
