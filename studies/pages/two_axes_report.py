"""The report on azimuth and elevation together, elevation with and without gravity in its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import Badge, Bullets, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_estimate, format_interval, format_number
from pages.figures_two_axes import intervals_of_axes

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
    axes: Sequence[IdentifiedAxis],
    control: Sequence[IdentifiedAxis],
    gravity_deg_per_s: float,
    provenance: Provenance,
) -> Report:
    """The report on azimuth, elevation without gravity and elevation with it, in this order.

    `control` is the elevation without gravity and with it where all other roots of G are known.
    """
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
        key_figure=intervals_of_axes(_deviations(axes)),
        sections=(
            *(Section(axis.name[0].upper() + axis.name[1:], (_table(axis),)) for axis in axes),
            Section(
                "Gravity alone",
                (
                    Paragraph(_alone(*control)),
                    intervals_of_axes(_deviations(control)),
                    *(_table(axis) for axis in control),
                ),
            ),
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


def _deviations(
    axes: Sequence[IdentifiedAxis],
) -> dict[str, dict[str, tuple[float, float, float]]]:
    return {
        axis.name: {parameter_name(n).symbol: p.relative for n, p in axis.parameters.items() if n != GRAVITY}
        for axis in axes
    }


def _alone(without: IdentifiedAxis, with_gravity: IdentifiedAxis) -> str:
    return (
        "The same records with the true other roots of G, so that nothing but gravity is wrong. Left out, the"
        f" lower limit is off by {_percent(without.parameters['saturation.lower'])}, the upper by"
        f" {_percent(without.parameters['saturation.upper'])}, and"
        f" {len(without.parameters) - len(without.missed)} of {len(without.parameters)} intervals hold the"
        f" truth; with it, {_percent(with_gravity.parameters['saturation.lower'])},"
        f" {_percent(with_gravity.parameters['saturation.upper'])}, and"
        f" {len(with_gravity.parameters) - len(with_gravity.missed)} of {len(with_gravity.parameters)}."
        " What is wrong beyond this in the sections above comes from roots of G that were identified and"
        " then held."
    )


def _verdict(
    azimuth: IdentifiedAxis, without: IdentifiedAxis, with_gravity: IdentifiedAxis, gravity_deg_per_s: float
) -> str:
    gravity = with_gravity.parameters[GRAVITY]
    return (
        f"Without gravity the elevation's fit is {format_number(without.fit_percent, 3, '%')}, with it"
        f" {format_number(with_gravity.fit_percent, 3, '%')} (azimuth"
        f" {format_number(azimuth.fit_percent, 3, '%')}); gravity is found at"
        f" {format_estimate(gravity.mean, gravity.sd, gravity.unit)}, where"
        f" {format_number(gravity_deg_per_s, 2, gravity.unit)} is true. The lower limit's interval is"
        f" {format_number(_widened(without, with_gravity), 2)} times as wide without it. With other roots"
        f" of G held as identified, intervals hold the truth for {_held(azimuth)} parameters of azimuth,"
        f" {_held(without)} of elevation without gravity and {_held(with_gravity)} with it."
    )


def _widened(without: IdentifiedAxis, with_gravity: IdentifiedAxis) -> float:
    name = "saturation.lower"
    return without.parameters[name].sd / with_gravity.parameters[name].sd


def _held(axis: IdentifiedAxis) -> str:
    return f"{len(axis.parameters) - len(axis.missed)} of {len(axis.parameters)}"


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
