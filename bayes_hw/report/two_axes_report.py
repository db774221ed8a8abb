"""The report on azimuth and elevation together, elevation with and without gravity in its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayes_hw.provenance import Provenance
from bayes_hw.report.document import Badge, Bullets, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.figures_two_axes import intervals_of_axes
from bayes_hw.report.names import parameter_name
from bayes_hw.report.rounding import format_estimate, format_interval, format_number

GRAVITY = "gravity"


@dataclass(frozen=True)
class AxisParameter:
    """The truth, and the posterior's mean, standard deviation and 94 % interval, in `unit`."""

    truth: float
    mean: float
    sd: float
    interval: tuple[float, float]
    unit: str

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.interval[0] <= self.truth <= self.interval[1]

    @property
    def relative(self) -> tuple[float, float, float]:
        """Mean and ends of the interval, as relative deviations from the truth."""
        low, high = sorted(end / self.truth - 1 for end in self.interval)
        return self.mean / self.truth - 1, low, high


@dataclass(frozen=True)
class IdentifiedAxis:
    """One axis under one model: smallest fit on a record, residual tests, order of G, posterior."""

    name: str
    fit_percent: float
    white: bool
    converged: bool
    order: int
    parameters: dict[str, AxisParameter]

    @property
    def missed(self) -> tuple[str, ...]:
        """Parameters whose interval does not hold the truth."""
        return tuple(name for name, parameter in self.parameters.items() if not parameter.covered)


def two_axes_report(
    axes: Sequence[IdentifiedAxis], gravity_deg_per_s: float, provenance: Provenance
) -> Report:
    """The report on azimuth, elevation without gravity and elevation with it, in this order."""
    azimuth, without, with_gravity = axes
    return Report(
        title="Azimuth and elevation",
        subtitle="Two simulated axes identified from their records; gravity in the elevation's model or not",
        verdict=_verdict(azimuth, without, with_gravity, gravity_deg_per_s),
        badges=tuple(
            Badge(
                axis.name,
                "bad"
                if axis.missed and not axis.white
                else "warn"
                if axis.missed or not axis.white
                else "good",
                f"{len(axis.parameters) - len(axis.missed)} of {len(axis.parameters)} intervals hold the"
                f" truth, fit {format_number(axis.fit_percent, 3, '%')}, residuals"
                f" {'white' if axis.white else 'not white'},"
                f" {'converged' if axis.converged else 'not converged'}",
            )
            for axis in axes
        ),
        key_figure=intervals_of_axes(
            {
                axis.name: {
                    parameter_name(n).symbol: p.relative for n, p in axis.parameters.items() if n != GRAVITY
                }
                for axis in axes
            }
        ),
        sections=(
            *(Section(axis.name[0].upper() + axis.name[1:], (_table(axis),)) for axis in axes),
            Section(
                "How it was found",
                (
                    Bullets(
                        (
                            "Each model comes from the four steps on the axis's own records; its dominant"
                            " parameters are sampled with the other roots of G as identified, which makes"
                            " intervals narrower than they should be.",
                            f"Gravity adds {format_number(gravity_deg_per_s, 2)} deg/s times the cosine of"
                            " the elevation to the command, before the limits; three records start at three"
                            " elevations, at rest.",
                            "With gravity in the model, its velocity is estimated by whitened least squares"
                            " together with the dominant parameters, and the posterior is a mixture over its"
                            " normal approximation (three Gauss-Hermite nodes).",
                        )
                    ),
                    Paragraph(
                        "A simulated axis, not a measured one: how large gravity's share is on a telescope,"
                        " and whether it enters as a velocity, is for its records to say."
                    ),
                ),
            ),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(
    azimuth: IdentifiedAxis, without: IdentifiedAxis, with_gravity: IdentifiedAxis, gravity_deg_per_s: float
) -> str:
    limits = [
        f"{parameter_name(name).words} off by {_percent(without.parameters[name])}"
        for name in ("saturation.lower", "saturation.upper")
    ]
    gravity = with_gravity.parameters[GRAVITY]
    return (
        f"Without gravity the elevation's fit is {format_number(without.fit_percent, 3, '%')}, with it"
        f" {format_number(with_gravity.fit_percent, 3, '%')} (azimuth"
        f" {format_number(azimuth.fit_percent, 3, '%')}); left out, {' and '.join(limits)}, and"
        f" {len(without.missed)} of {len(without.parameters)} intervals do not hold the truth, against"
        f" {len(with_gravity.missed)} of {len(with_gravity.parameters)} with it. Gravity is found at"
        f" {format_estimate(gravity.mean, gravity.sd, gravity.unit)}; {format_number(gravity_deg_per_s, 2)}"
        f" deg/s is true."
    )


def _percent(parameter: AxisParameter) -> str:
    return format_number(100 * parameter.relative[0], 2, "%")


def _table(axis: IdentifiedAxis) -> Table:
    return Table(
        ("parameter", "truth", "posterior", "94 % interval", "holds the truth"),
        tuple(
            (
                "velocity that gravity adds at the horizon"
                if name == GRAVITY
                else parameter_name(name).words,
                format_number(p.truth, 4, p.unit),
                format_estimate(p.mean, p.sd, p.unit),
                format_interval(*p.interval, p.unit),
                "yes" if p.covered else "no",
            )
            for name, p in axis.parameters.items()
        ),
        f"{axis.name[0].upper()}{axis.name[1:]}: model of order {axis.order}, residuals"
        f" {'white' if axis.white else 'not white'}.",
        (1, 2, 3),
    )
