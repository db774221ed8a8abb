"""Responses of poles to the commands of records begun in motion, and free ones, over samples.

An equation is a sample of a record, whitened by the noise of the estimate. Free and commanded responses of a
slow pole all but coincide, and only together, sample by sample, say where weights and states go. Some hundred
samples of a record, denser at its beginning where states are told, each stand for those about them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.compiled import compiled
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.modal import LinearBatch, ResidueBatch
from bayes_hw.record import Record

SAMPLES = 256
"""Of one record, at most."""

FADED = 1e-30
"""A response so small is none; commands are off zero by as little: numbers near the smallest are slow."""


@dataclass(frozen=True, eq=False)
class ResponsesInTime:
    """`commands` (all samples,) of the records as G gets them, whitened, from `begins` (records + 1,) on;
    equations are `samples` (equations,) of these, weighed by `scale`; of the equations those of a record are
    from `first` (records + 1,) on. `left` (equations,) is what the estimate answers.
    """

    rounding: ClassVar[float] = 1e-12
    """Of products scaled to unit diagonal, added to it: responses that all but coincide."""

    axis: AxisParameters
    autoregression: FloatArray
    commands: FloatArray
    begins: IntArray
    samples: IntArray
    first: IntArray
    scale: FloatArray
    left: FloatArray

    @classmethod
    def of(
        cls,
        axis: AxisParameters,
        values: FloatArray,
        noise: NoiseEstimate,
        records: Sequence[Record],
        power: float,
    ) -> ResponsesInTime:
        """At an estimate `values` (parameters,) and the noise there, the likelihood to a `power`."""
        lower, upper, delay = values[0], values[1], axis.model.linear.delay_samples
        phi = np.asarray(noise.autoregression, dtype=np.float64)
        whitener = np.concatenate([[1.0], -phi])
        commands, samples, spacing = [], [], []
        begins = np.concatenate([[0], np.cumsum([len(record) for record in records])])
        for record, begin in zip(records, begins, strict=False):
            given = np.concatenate([np.full(delay, record.u[0]), record.u])[: len(record)]
            commands.append(np.convolve(np.clip(given, lower, upper), whitener)[: len(record)])
            told = np.flatnonzero(record.measured_samples)[len(phi) :]
            places = np.unique((len(told) * np.linspace(0, 1, SAMPLES + 1) ** 2).astype(np.int64))
            samples.append(begin + told[(places[:-1] + places[1:] - 1) // 2])
            spacing.append(np.diff(places))
        unscaled = cls(
            axis,
            phi,
            np.concatenate(commands) + FADED,
            begins,
            np.concatenate(samples),
            np.concatenate([[0], np.cumsum([len(part) for part in samples])]),
            np.sqrt(power * np.concatenate(spacing)) / noise.innovation_sigma,
            np.zeros(sum(len(part) for part in samples)),
        )
        return unscaled.answering(values)

    def answering(self, values: FloatArray) -> ResponsesInTime:
        """The same with what the parameters `values` (parameters,) answer as what is left to explain."""
        axis = self.axis
        gain = values[axis.names.index("velocity_gain")] if "velocity_gain" in axis.names else 0.0
        per_sample = np.array([gain / axis.model.sample_rate_hz])
        rows, wanted = self(axis.linear_batch(values[:, None]), per_sample)
        answered = values[[*axis.weight_rows, *axis.start_rows]] @ rows[0] - wanted[0]
        return replace(self, left=answered)

    def __call__(
        self, batch: LinearBatch | ResidueBatch, per_sample: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Responses (points, weights and states, equations) to one of each, and what the integrator of
        `per_sample` (points,) leaves to them (points, equations)."""
        axis = self.axis
        states = axis.initial_states
        count = len(axis.weight_rows) + len(axis.start_rows)
        rows = np.zeros((len(per_sample), count, len(self.samples)))
        wanted = np.empty((len(per_sample), len(self.samples)))
        _fill(
            np.ascontiguousarray(batch.real_poles.T),
            np.ascontiguousarray(batch.pair_poles.T),
            per_sample,
            np.array(axis.free_real, dtype=np.int64),
            np.array(states.all_real, dtype=np.int64),
            np.array(states.pairs, dtype=np.int64),
            len(axis.weight_rows),
            self.autoregression,
            self.commands,
            self.begins,
            self.samples,
            self.first,
            self.scale,
            self.left,
            rows,
            wanted,
        )
        return rows, wanted


@compiled(nogil=True)
def _fill(  # type: ignore[no-untyped-def]
    real_poles,
    pair_poles,
    per_sample,
    weighed,
    free_real,
    free_pairs,
    n_weights,
    phi,
    commands,
    begins,
    samples,
    first,
    scale,
    left,
    every,
    all_wanted,
):
    """Responses `every` (points, n, equations), zero before, `all_wanted` (points, equations), in place."""
    n_real, n_pairs = len(weighed), pair_poles.shape[1]
    n_free = len(free_real) + 2 * len(free_pairs)
    for k in range(len(every)):
        rows, wanted, pairs = every[k], all_wanted[k], pair_poles[k]
        for record in range(len(begins) - 1):
            x, s, integral = np.zeros(n_real), np.zeros(n_pairs, dtype=np.complex128), 0.0
            equation = first[record]
            for sample in range(begins[record], begins[record + 1]):
                if equation == first[record + 1]:
                    break
                v = commands[sample]
                if sample == samples[equation]:
                    size = scale[equation]
                    for i in range(n_real):
                        rows[i, equation] = size * x[i]
                    for i in range(n_pairs):
                        rows[n_real + 2 * i, equation] = size * s[i].real
                        rows[n_real + 2 * i + 1, equation] = size * s[i].imag
                    if n_real + 2 * n_pairs < n_weights:
                        rows[n_weights - 1, equation] = size * v
                    wanted[equation] = left[equation] - size * per_sample[k] * integral
                    equation += 1
                integral += v
                for i in range(n_real - 1, 0, -1):
                    x[i] = real_poles[k, weighed[i]] * x[i] + x[i - 1]
                if n_real:
                    x[0] = real_poles[k, weighed[0]] * x[0] + v
                for i in range(n_pairs):
                    s[i] = pairs[i] * s[i] + v
            row = n_weights + record * n_free
            for i in range(len(free_real) + len(free_pairs)):
                real = i < len(free_real)
                pole = complex(real_poles[k, free_real[i]]) if real else pairs[free_pairs[i - len(free_real)]]
                response, now = complex(1.0), begins[record]
                for lag in range(len(phi)):
                    response -= phi[lag] * pole ** (-1 - lag)
                for equation in range(first[record], first[record + 1]):
                    for _ in range(samples[equation] - now):
                        response *= pole
                    now = samples[equation]
                    if abs(response) < FADED:
                        break
                    rows[row, equation] = scale[equation] * response.real
                    if not real:
                        rows[row + 1, equation] = scale[equation] * response.imag
                row += 1 if real else 2
