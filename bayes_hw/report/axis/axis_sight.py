"""What an engineer looks at first: response over frequency, step of the velocity, error over speed and
position, from a diagnosis of records alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import FrequencyResponse, frequency_response
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior.joint_closure import differ
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.response.effect_paths import drive_response, through_drive
from bayes_hw.infer.dead_zone_trade import Trade
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record
from bayes_hw.report.page.document import Paragraph, Table
from bayes_hw.report.page.rounding import format_number, format_percent
from bayes_hw.report.page.typography import typeset


def trade_blocks(trade: Trade) -> tuple[Paragraph, Table]:
    """What trades places with the dead zone, in words and numbers."""
    return (
        Paragraph(typeset(trade.sentence[:1].upper() + trade.sentence[1:] + ".")),
        Table(
            ("known", "standard deviation of the half width", "share of its variance"),
            (
                ("nothing", format_number(trade.sd, 2, trade.unit), ""),
                *(
                    (group, format_number(sd, 2, trade.unit), format_percent(trade.share(group)))
                    for group, sd in trade.sd_known.items()
                ),
            ),
            "What would be left of the dead zone's uncertainty were other parameters known, from the "
            "covariance of the draws in coordinates. Shares overlap where groups are correlated.",
            (1, 2),
        ),
    )


CELLS = 20
STEP_SHARE = 0.5
STEP_PERIODS = 8.0
STEP_DRAWS = 40
RISE_DB = 20.0
"""By which a response that grows from where it is excited to half the sample rate is remarked on."""

TRUSTED = 0.8
"""Coherence up to which a measured response decides on the model's."""


@dataclass(frozen=True, eq=False)
class Sight:
    """`measured` over frequency (None where records are too short), `alike` the same estimate of what the
    model with its effects simulates; the response of G alone, `model` (frequencies,) at `frequency_hz` with
    its interval `low`, `high`; of the velocity, over the velocity gain `gain`.
    `modes` in Hz; a `remark` or "".
    """

    measured: FrequencyResponse | None
    alike: FrequencyResponse | None
    gain: float
    frequency_hz: FloatArray
    model: FloatArray
    low: FloatArray
    high: FloatArray
    modes: tuple[float, ...]
    remark: str


def axis_sight(records: Sequence[Record], posterior: JointPosterior) -> Sight:
    """Measured and modelled response of the velocity to the limited command, over the velocity gain."""
    fit = posterior.fit
    rate, values, structure = fit.response.scale.rate_hz, fit.values, fit.structure
    runs = [fit.response.simulate(values, r.u, r.known) for r in records]
    measured = frequency_response([r.y for r in records], [run.v for run in runs], rate)
    alike = frequency_response([run.y for run in runs], [run.v for run in runs], rate)
    gain = velocity_gain(fit)
    f = np.geomspace(rate / 2000, 0.499 * rate, 300)
    z = np.exp(2j * np.pi * f / rate)
    speed = np.abs(z - 1) * rate / abs(gain)
    some = [fit.response.values(x) for x in posterior.coordinates[:200]]
    drawn = np.array([np.abs(drive_response(structure, v, z)) for v in some]) * speed
    low, model, high = np.quantile(drawn, [0.03, 0.5, 0.97], axis=0)
    modes = tuple(
        float(np.median(d)) for n, d in posterior.base.items()
        if n.startswith("mode") and n.endswith("frequency_hz")
    )  # fmt: skip
    return Sight(measured, alike, gain, f, model, low, high, modes, rise_remark(f, model, measured))


def velocity_gain(fit: JointFit) -> float:
    """Steady velocity, output units/s, per unit of the limited command; that of the slowest frequency where G
    has no integrator."""
    rate = fit.response.scale.rate_hz
    if fit.structure.integrator:
        return float(fit.values.cascade.integrator_residue) * rate
    z = np.exp(2j * np.pi * np.array([rate / 2000]) / rate)
    return float(np.abs((drive_response(fit.structure, fit.values, z) * (z - 1))[0])) * rate


def rise_remark(f: FloatArray, model: FloatArray, measured: FrequencyResponse | None) -> str:
    """Where a response of the velocity `model` (frequencies,) rises by RISE_DB beyond what was measured; ""
    elsewhere."""
    excited = float(f[-1]) / 2
    if measured is not None and (measured.coherence > TRUSTED).any():
        excited = float(measured.frequency_hz[measured.coherence > TRUSTED][-1])
    rise = 20 * float(np.log10(model[-1] / np.interp(excited, f, model)))
    if rise < RISE_DB:
        return ""
    return (
        f"From {excited:.3g} Hz, the highest frequency that the records show, to half the sample rate "
        f"the model rises by {rise:.0f} dB. Nothing was measured there: close no loop on it, put a low pass."
    )


@dataclass(frozen=True, eq=False)
class StepOfVelocity:
    """Velocity (samples,), output units/s, after a step of the command from rest, with its interval;
    `without` is the same without the effects."""

    t: FloatArray
    command: float
    velocity: FloatArray
    low: FloatArray
    high: FloatArray
    without: FloatArray


def velocity_step(records: Sequence[Record], posterior: JointPosterior) -> StepOfVelocity:
    """At half of the smaller limit, for as long as the lowest mode takes to swing some times."""
    fit = posterior.fit
    rate = fit.response.scale.rate_hz
    modes = [float(np.median(d)) for n, d in posterior.base.items() if n.endswith("frequency_hz")]
    seconds = STEP_PERIODS / min(modes) if modes else 5.0
    largest = max(float(np.abs(r.u).max()) for r in records)
    limits = [abs(x) for x in (fit.values.cascade.lower, fit.values.cascade.upper) if np.isfinite(x)]
    command = STEP_SHARE * min([*limits, largest])
    columns = {e.form.column for e in fit.response.template if e.form.is_known_input}
    lead = max(round(0.05 * seconds * rate), 2)
    u = np.concatenate([np.zeros(lead), np.full(max(round(seconds * rate), 20), command)])

    at_rest = {column: np.zeros(len(u)) for column in columns}

    def velocity(one: FloatArray) -> FloatArray:
        w = fit.response.simulate(fit.response.values(one), u, at_rest).w
        return np.diff(w, prepend=0.0) * rate

    drawn = np.array([velocity(x) for x in posterior.coordinates[:STEP_DRAWS]])
    low, middle, high = np.quantile(drawn, [0.03, 0.5, 0.97], axis=0)
    delay = fit.structure.delay_samples
    delayed = np.concatenate([np.zeros(delay), u])[: len(u)]
    plain = np.diff(through_drive(fit.structure, fit.values, delayed[None, :])[0], prepend=0.0) * rate
    t = (np.arange(len(u)) - lead) / rate
    return StepOfVelocity(t, command, middle, low, high, plain)


def step_of_models(models: Sequence[HammersteinWiener], mean: HammersteinWiener) -> StepOfVelocity:
    """The same of models alone, the first draws of a posterior; `without` is the mean's own."""
    rate, modes = mean.sample_rate_hz, [mode.frequency_hz for mode in mean.dominant_modes]
    seconds = STEP_PERIODS / min(modes) if modes else 5.0
    lead = max(round(0.05 * seconds * rate), 2)
    command = STEP_SHARE * min(abs(mean.saturation.lower), mean.saturation.upper)
    u = np.concatenate([np.zeros(lead), np.full(max(round(seconds * rate), 20), command)])

    def velocity(model: HammersteinWiener) -> FloatArray:
        return np.asarray(np.diff(model.linear.filter(model.saturation(u)), prepend=0.0) * rate)

    low, high = np.quantile([velocity(model) for model in models], [0.03, 0.97], axis=0)
    at_mean = velocity(mean)
    return StepOfVelocity((np.arange(len(u)) - lead) / rate, command, at_mean, low, high, at_mean)


def errors_of_residuals(
    records: Sequence[Record], residuals: Sequence[FloatArray]
) -> tuple[ErrorOver, ErrorOver]:
    """Mean residuals over speed, that of the readings, and over position."""
    rate, unit = records[0].sample_rate_hz, records[0].units.output
    error = np.nan_to_num(np.concatenate(list(residuals)))
    smooth = max(round(0.1 * rate), 3)
    speed = np.concatenate([uniform_filter1d(np.gradient(r.y) * rate, smooth) for r in records])
    position = np.concatenate([r.y + r.origin for r in records])
    return (
        _in_cells("speed", f"{unit}/s", speed, error, error),
        _in_cells("position", unit, position, error, error),
    )


@dataclass(frozen=True, eq=False)
class ErrorOver:
    """Mean error (cells,) in cells, before and after the effects, and its standard error."""

    name: str
    unit: str
    x: FloatArray
    before: FloatArray
    after: FloatArray
    standard_error: FloatArray

    @property
    def compared(self) -> bool:
        """Whether before and after differ at all."""
        return differ(self.before, self.after, float(np.max(self.standard_error, initial=0.0)))


def errors_over(records: Sequence[Record], base: JointFit, fit: JointFit) -> tuple[ErrorOver, ErrorOver]:
    """Over speed and over position."""
    rate, unit = fit.response.scale.rate_hz, records[0].units.output
    runs = [fit.response.simulate(fit.values, r.u, r.known) for r in records]
    plain = [base.response.simulate(base.values, r.u, r.known).y for r in records]
    held = [r.measured_samples for r in records]
    after = np.concatenate([np.where(m, r.y - x.y, 0.0) for r, x, m in zip(records, runs, held, strict=True)])
    before = np.concatenate([np.where(m, r.y - y, 0.0) for r, y, m in zip(records, plain, held, strict=True)])
    speed = np.concatenate([np.gradient(run.w) * rate for run in runs])
    position = np.concatenate([r.y + r.origin for r in records])
    return (
        _in_cells("speed", f"{unit}/s", speed, before, after),
        _in_cells("position", unit, position, before, after),
    )


def _in_cells(name: str, unit: str, x: FloatArray, before: FloatArray, after: FloatArray) -> ErrorOver:
    edges = np.linspace(x.min(), x.max(), CELLS + 1)
    at = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, CELLS - 1)
    cells = [np.flatnonzero(at == i) for i in range(CELLS)]
    cells = [cell for cell in cells if len(cell) > 9]
    mean_before, mean_after = (np.array([float(e[cell].mean()) for cell in cells]) for e in (before, after))
    error = np.array([float(after[cell].std()) / np.sqrt(len(cell)) for cell in cells])
    middle = np.array([float(x[cell].mean()) for cell in cells])
    return ErrorOver(name, unit, middle, mean_before, mean_after, error)
