"""The records of one identification, scaled, with what the early steps need of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray, white_sigma
from bayes_hw.errors import InputError
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.holes import without_past
from bayes_hw.identify.subspace import ObservabilitySubspace, observability_subspace
from bayes_hw.model.sample_rate import check_alike
from bayes_hw.record import Record

MIN_SAMPLES = 200
"""Samples that all records together must have."""

BLOCK_ROWS = 20
"""Block rows of the Hankel matrices: one second at 20 Hz, and more than any order tried."""

DECIMATIONS = (1, 2, 5, 10, 20, 50)
MIN_DECIMATED_RATE_HZ = 10.0
MIN_DECIMATED_SAMPLES = 400

SMALLEST_COMMAND = 1e-3
"""A limit is looked for on a side whose largest command exceeds this fraction of the largest of all."""

OUTSIDE_NOISE = 4.0
"""An output this many noise levels from zero has left a dead zone."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """Records whose commands are in units of `input_scale` and outputs in units of `output_scale`.

    `noise_level` is the standard deviation of the output's white part, scaled. `moving` marks, per record,
    the samples whose output and the one before it lie on one side of zero and clear of it: there an
    increment of y is an increment of w, whatever the dead zone. `free_start`: every record has initial
    states of its own.
    """

    records: tuple[Record, ...]
    input_scale: float
    output_scale: float
    noise_level: float
    moving: tuple[FloatArray, ...]
    free_start: bool

    @property
    def commands(self) -> list[FloatArray]:
        return [record.u for record in self.records]

    @property
    def outputs(self) -> list[FloatArray]:
        return [record.y for record in self.records]

    @property
    def sides_commanded(self) -> tuple[bool, bool]:
        """Whether there are commands below and above zero: only there a limit can be looked for."""
        commands = np.concatenate(self.commands)
        return bool(commands.min() < -SMALLEST_COMMAND), bool(commands.max() > SMALLEST_COMMAND)

    @property
    def samples(self) -> int:
        return sum(len(record) for record in self.records)

    @property
    def sample_rate_hz(self) -> float:
        return self.records[0].sample_rate_hz

    def without_past(self, delay_samples: int) -> Experiment:
        """The same without the outputs that commands before the records decide, see `holes.without_past`."""
        records = without_past(self.records, delay_samples)
        return replace(self, records=records, moving=moving_samples(records, self.noise_level))

    def in_original_units(self, values: CascadeValues) -> CascadeValues:
        """A parameter vector of the scaled records in the units of the records as given."""
        gain = self.output_scale / self.input_scale
        return CascadeValues(
            lower=values.lower * self.input_scale,
            upper=values.upper * self.input_scale,
            half_width=values.half_width * self.output_scale,
            input_offset=values.input_offset * self.input_scale,
            integrator_residue=values.integrator_residue * gain,
            real=values.real * np.array([[1.0], [gain]]),
            sections=values.sections * np.array([[1.0], [1.0], [gain], [gain]]),
            starts=values.starts * self.output_scale,
        )


def prepare(records: Sequence[Record], *, free_start: bool) -> Experiment:
    """Check that the records belong to one axis, and scale them.

    Raises InputError when rates or units differ, the command or output is constant, or too few samples are
    given.
    """
    _check(records)
    input_scale = max(float(np.abs(record.u).max()) for record in records)
    output_scale = max(float(np.std(record.y)) for record in records)
    scaled = tuple(replace(record, u=record.u / input_scale, y=record.y / output_scale) for record in records)
    level = white_noise_level([record.y_or_nan for record in scaled])
    moving = moving_samples(scaled, level)
    return Experiment(scaled, input_scale, output_scale, level, moving, free_start)


def moving_samples(records: Sequence[Record], noise_level: float) -> tuple[FloatArray, ...]:
    """`Experiment.moving` of scaled records; everything where next to nothing is clear of zero."""
    moving = tuple(_moving(record.y_or_nan, OUTSIDE_NOISE * noise_level) for record in records)
    if sum(np.count_nonzero(mask) for mask in moving) < MIN_SAMPLES // 2:
        return tuple(_increments_measured(record) for record in records)
    return moving


def _increments_measured(record: Record) -> FloatArray:
    """One where an output and the one before were measured, the first counting as its own, else zero."""
    known = record.measured_samples
    return (known & np.append(known[:1], known[:-1])).astype(np.float64)


@dataclass(frozen=True, eq=False)
class PoleSource:
    """Subspaces of the records at several decimations, from which poles of any order follow."""

    subspaces: tuple[tuple[int, ObservabilitySubspace], ...]

    def candidates(self, order: int) -> list[ComplexArray]:
        """One set of `order` poles, at the full rate, from each decimation that gives one."""
        return [_at_full_rate(subspace.poles(order), factor) for factor, subspace in self.subspaces]


def pole_source(experiment: Experiment, commands: Sequence[FloatArray]) -> PoleSource:
    """Subspaces from `commands` to the increments of the output.

    Increments take the integrator out. A mode that is slow against the sample rate shows only at a lower
    rate: commands are then averaged over each longer interval, outputs taken at its start.
    """
    found = []
    for factor in DECIMATIONS:
        enough = experiment.samples // factor >= MIN_DECIMATED_SAMPLES
        if factor > 1 and (experiment.sample_rate_hz / factor < MIN_DECIMATED_RATE_HZ or not enough):
            continue
        slow_commands = [u[: len(u) // factor * factor].reshape(-1, factor).mean(axis=1) for u in commands]
        slow_outputs = [y[: len(y) // factor * factor : factor] for y in experiment.outputs]
        increments = [np.diff(y, prepend=y[:1]) for y in slow_outputs]
        block_rows = min(BLOCK_ROWS, max(len(y) for y in slow_outputs) // 5)
        found.append((factor, observability_subspace(slow_commands, increments, block_rows)))
    return PoleSource(tuple(found))


def _check(records: Sequence[Record]) -> None:
    check_alike(records)
    for record in records:
        for column in ("u", "y"):
            if np.ptp(getattr(record, column)) == 0:
                raise InputError(
                    f"record {record.name}: {column} is constant; give a record in which the axis moves"
                )
    samples = sum(len(record) for record in records)
    if samples < MIN_SAMPLES or max(len(record) for record in records) < MIN_SAMPLES // 2:
        raise InputError(
            f"record {records[0].name}: {samples} samples are too few to identify an axis; "
            f"give at least {MIN_SAMPLES}, half of them in one record"
        )


def white_noise_level(outputs: Sequence[FloatArray]) -> float:
    """Standard deviation of white noise whose third differences have the median seen, or the resolution.

    Outputs are NaN where nothing was measured.
    """
    steps = np.abs(np.concatenate([np.diff(y) for y in outputs]))
    resolution = float(steps[steps > 0].min()) / np.sqrt(12.0)
    return max(white_sigma(outputs), resolution)


def _moving(y: FloatArray, threshold: float) -> FloatArray:
    outside = np.abs(y) > threshold
    mask = np.zeros(len(y))
    mask[1:] = outside[1:] & outside[:-1] & (np.sign(y[1:]) == np.sign(y[:-1]))
    return mask


def _at_full_rate(poles: ComplexArray, factor: int) -> ComplexArray:
    """The poles p with p^factor = poles; a negative real one has no such pair and gives |p|^(1/factor)."""
    if factor == 1:
        return poles
    roots = np.where(poles.imag == 0, np.abs(poles), poles) ** (1 / factor)
    return np.asarray(roots, dtype=np.complex128)
