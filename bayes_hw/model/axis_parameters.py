"""The parameter vector of a Hammerstein-Wiener axis, and how it becomes a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.initial_state import InitialStates
from bayes_hw.model.kernel import AT_REST, KnownSignals
from bayes_hw.model.known_input import TORQUE
from bayes_hw.model.linear import INTEGRATOR_RADIUS, Mode
from bayes_hw.model.modal import (
    LinearBatch,
    ModalForm,
    ResidueBatch,
    linear_batch,
    modal_form,
    moved_apart,
    numerator_coefficient,
)
from bayes_hw.model.mode_poles import mode_poles, squared_distances
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import (
    HalfNormal,
    Identity,
    Logarithm,
    LogNormal,
    Normal,
    NormalProbability,
    TimeConstant,
    TimeConstantLogarithm,
    Uniform,
)
from bayes_hw.model.residues import (
    NEGLIGIBLE,
    nested_residues,
    nested_weights,
    residues_at,
)

FreeSet: TypeAlias = Literal["conditional", "all"]

LIMIT_LOG_SD = 0.3
GAIN_LOG_SD = 0.3
FREQUENCY_LOG_SD = 0.1
DAMPING_LOG_SD = 0.8
TIME_CONSTANT_LOG_SD = 1.0
FASTEST_DECAY = 1.0
"""Time constant in samples from which a real pole is given by it."""

DEAD_ZONE_SCALE = 3.0
WEIGHT_SD = 1.0
"""Prior standard deviation of a residue, in units of the largest nominal one."""

LARGEST_DAMPING = 0.999


class AxisParameters:
    """Which numbers of a Hammerstein-Wiener model are free, and how a vector of them becomes a model.

    `free` is "conditional": saturation limits, dead zone, gain, frequencies and dampings of the dominant
    modes, given the other roots of G; or "all": every pole of G but an integrator, and in place of the zeros
    and the gain the weight of every pole (of the integrator as velocity gain, of pairs as cosine and sine of
    their impulse response, of real poles nested, see `nested_weights`), in which the response is linear.
    With `start_positions` the initial state of every record is free as well. Of every known input of the
    model the weights of its response are free, in which that is linear; its poles are held.
    """

    def __init__(
        self,
        model: HammersteinWiener,
        free: FreeSet = "conditional",
        *,
        output_scale: float = 1.0,
        start_positions: FloatArray | None = None,
        held_poles: Sequence[str] = (),
    ) -> None:
        """`output_scale` is the size of the output (output units): it scales the prior of a dead zone whose
        nominal width is zero, and the priors of the initial states. `start_positions` holds the measured
        first output of every record when the initial conditions are free, else None (rest at w = 0).
        `held_poles` names real poles, such as real_pole2, that stay where the model has them while their
        weights are free.
        """
        self.model = model
        self.free: FreeSet = free
        self.output_scale = output_scale
        self.start_positions = start_positions
        self.held_poles = tuple(held_poles)
        poles = model.linear.poles
        self._real_poles = np.sort(poles[poles.imag == 0].real)
        distance = np.abs(self._real_poles - 1)
        is_integrator = distance.size > 0 and distance.min() <= INTEGRATOR_RADIUS
        self._integrator = int(np.argmin(distance)) if is_integrator else None
        dominant = model.mode_indices()
        others = [int(i) for i in np.flatnonzero(poles.imag > 0) if i not in dominant]
        others.sort(key=lambda i: abs(np.log(poles[i])))
        self._pair_poles = poles[[*dominant, *others]]
        self._mode_names = [f"mode{i + 1}" for i in range(len(dominant))]
        self._other_pair_names = [f"pole_pair{i + 1}" for i in range(len(others))]
        self._pair_names = [*self._mode_names, *self._other_pair_names]
        self._free_real = [i for i in range(len(self._real_poles)) if i != self._integrator]
        structure = [*self._static_parameters(), *self._linear_parameters(), *self._known_parameters()]
        self._n_structure = len(structure)
        self._states = InitialStates.of_poles(self._real_poles, self._pair_poles, self._integrator)
        starts: list[Parameter] = []
        if start_positions is not None:
            starts = self._states.parameters(start_positions.tolist(), model.units.output, output_scale)
        self.parameters: tuple[Parameter, ...] = (*structure, *starts)
        self._row = {parameter.name: row for row, parameter in enumerate(self.parameters)}
        names = [f"real_pole{i + 1}" for i in self._free_real]
        self._moving = np.array([f"{name}.value" in self._row for name in names], dtype=np.bool_)
        self._value_rows = [self._row[f"{name}.value"] for name in names if f"{name}.value" in self._row]
        self._weight_rows = [self._row[f"{name}.weight"] for name in names if f"{name}.weight" in self._row]
        kinds = [
            [row for name, row in self._row.items() if name.startswith(kind) and name.endswith(what)]
            for kind, what in (("mode", "_hz"), ("pole_pair", "_hz"), ("real_pole", ".value"))
        ]
        self._interchangeable = [rows for rows in kinds if len(rows) > 1]
        self._free_pairs = [
            i for i, name in enumerate(self._pair_names) if f"{name}.frequency_hz" in self._row
        ]
        self._frequency_rows = [self._row[f"{self._pair_names[i]}.frequency_hz"] for i in self._free_pairs]
        self._damping_rows = [self._row[f"{self._pair_names[i]}.damping_ratio"] for i in self._free_pairs]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def free_real(self) -> list[int]:
        """The real poles but an integrator among those of `linear_batch`, in the order of their weights."""
        return self._free_real

    @property
    def weight_rows(self) -> tuple[int, ...]:
        """The rows of the weights of G's poles: real ones, cosine and sine of pairs, the direct term."""
        names = [f"{name}.{part}" for name in self._pair_names for part in ("cosine", "sine")]
        return (*self._weight_rows, *(self._row[name] for name in [*names, "direct"] if name in self._row))

    @property
    def initial_states(self) -> InitialStates:
        """Which poles have a state of their own where a record begins in motion."""
        return self._states

    @property
    def start_rows(self) -> tuple[int, ...]:
        """The rows of the initial states of all records, one after the other; none where these rest."""
        records = 0 if self.start_positions is None else len(self.start_positions)
        return tuple(range(self._n_structure, self._n_structure + records * self._states.count))

    @property
    def nominal(self) -> FloatArray:
        """Values of the nominal model, shape (parameters,)."""
        return np.array([parameter.nominal for parameter in self.parameters])

    def in_order(self, values: FloatArray) -> BoolArray:
        """Whether modes, other pole pairs and real poles keep the order that gives them their numbers.

        Exchanging two poles of a kind changes nothing but their names. For values (parameters, walkers).
        """
        kept = np.ones(values.shape[1], dtype=np.bool_)
        for rows in self._interchangeable:
            kept &= np.all(values[rows[1:]] > values[rows[:-1]], axis=0)
        return kept

    def put_in_order(self, values: FloatArray) -> FloatArray:
        """One parameter vector (parameters,) with its poles renumbered so that `in_order` holds."""
        ordered = values.copy()
        for names in (self._mode_names, self._other_pair_names):
            rows = np.array([self._rows_starting(f"{name}.") for name in names], dtype=int)
            if len(rows) > 1 and rows.shape[1]:
                ordered[rows] = values[rows[np.argsort(values[rows[:, 0]])]]
        if self.free == "all" and len(self._value_rows) > 1:
            poles, weights = self._decaying_poles(values[:, None]), values[self._weight_rows, None]
            residues, order = nested_residues(moved_apart(poles), weights), np.arange(len(poles))
            free = np.flatnonzero(self._moving)
            order[free] = free[np.argsort(poles[free, 0])]
            ordered[self._value_rows] = poles[order[free], 0]
            ordered[self._weight_rows] = nested_weights(poles[order], residues[order])[:, 0]
        return ordered

    def _decaying_poles(self, values: FloatArray) -> FloatArray:
        """The real poles but an integrator, (poles, walkers)."""
        poles = np.repeat(self._real_poles[self._free_real, None], values.shape[1], axis=1)
        poles[self._moving] = values[self._value_rows]
        return poles

    def modal_form(self, values: FloatArray, record: int = 0) -> ModalForm:
        """The modal form of every column of `values` (parameters, walkers), started as record `record`."""
        linear = self.linear_batch(values)
        gains = self.model.normalization
        static = np.empty((6, values.shape[1]))
        static[0], static[1], static[3] = values[0], values[1], values[2]
        static[2], static[4], static[5] = gains.c1, gains.c2, gains.c3
        form = modal_form(linear, static)
        if self.model.known:
            form = replace(form, known=values[self._known_order])
        if self.start_positions is None:
            return form
        begin = self._n_structure + record * self._states.count
        start = values[begin : begin + self._states.count]
        offset = np.sign(self.start_positions[record]) * values[2]
        return self._states.apply(form, linear.pair_poles, start, offset)

    def linear_batch(self, values: FloatArray) -> LinearBatch | ResidueBatch:
        """The linear blocks of every column of `values` (parameters, walkers)."""
        walkers, rate = values.shape[1], self.model.sample_rate_hz
        real_poles = np.repeat(self._real_poles[:, None], walkers, axis=1)
        pair_poles = np.repeat(self._pair_poles[:, None], walkers, axis=1)
        if self._free_pairs:
            for pair, poles in zip(self._free_pairs, mode_poles(*self._modes(values), rate), strict=True):
                pair_poles[pair] = poles
        if self.free == "conditional":
            zeros = self.model.linear.zeros[:, None]
            return LinearBatch(real_poles, pair_poles, zeros, values[self._row["gain"]])
        real_residues = np.empty_like(real_poles)
        if self._free_real:
            real_poles[self._free_real] = moved_apart(self._decaying_poles(values))
            real_residues[self._free_real] = nested_residues(
                real_poles[self._free_real], values[self._weight_rows]
            )
        if self._integrator is not None:
            real_residues[self._integrator] = values[self._row["velocity_gain"]] / rate
        cosine = np.array([values[self._row[f"{name}.cosine"]] for name in self._pair_names])
        sine = np.array([values[self._row[f"{name}.sine"]] for name in self._pair_names])
        pair_residues = (0.5 * (cosine - 1j * sine)).reshape(len(self._pair_names), walkers)
        direct = values[self._row["direct"]] if "direct" in self._row else np.zeros(walkers)
        return ResidueBatch(real_poles, pair_poles, real_residues, pair_residues, direct)

    def gain(self, values: FloatArray) -> FloatArray:
        """The numerator coefficient of G at the power of z that leads the model's numerator, for every column
        of `values` (parameters, walkers)."""
        if self.free == "conditional":
            return values[self._row["gain"]]
        linear = self.model.linear
        return numerator_coefficient(self.linear_batch(values), len(linear.poles) - len(linear.zeros))

    def velocity_gain(self, values: FloatArray) -> FloatArray:
        """Steady output velocity per unit of v for every column of `values`; NaN without an integrator."""
        if self._integrator is None:
            return np.full(values.shape[1], np.nan)
        rate = self.model.sample_rate_hz
        if self.free == "all":
            batch = self.linear_batch(values)
            return batch.separated().residues()[0][self._integrator] * rate
        distances = squared_distances(*self._modes(values), rate, self._real_poles[self._integrator])
        return np.asarray(values[self._row["gain"]] * self._fixed_velocity_gain / distances)

    def _modes(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Frequencies and damping ratios (modes, walkers) of the modes that are free, row by row: to index by
        a list lets go of the interpreter, and threads side by side wait for it."""
        shape = (len(self._free_pairs), values.shape[1])
        frequencies, damping = np.empty(shape), np.empty(shape)
        for i, (frequency_row, damping_row) in enumerate(
            zip(self._frequency_rows, self._damping_rows, strict=True)
        ):
            frequencies[i] = values[frequency_row]
            np.minimum(values[damping_row], LARGEST_DAMPING, out=damping[i])
        return frequencies, damping

    @cached_property
    def _fixed_velocity_gain(self) -> float:
        """Steady velocity per v and unit of gain by the roots that are held."""
        pole = self._real_poles[self._integrator]
        held = np.delete(self._pair_poles, self._free_pairs)
        passed = np.prod(pole - self._real_poles[self._free_real])
        zeros = np.prod(pole - self.model.linear.zeros).real
        return float(zeros / (passed * np.prod(np.abs(pole - held) ** 2)) * self.model.sample_rate_hz)

    def frequency_response(self, values: FloatArray, frequency_hz: FloatArray) -> ComplexArray:
        """G at every frequency for every column of `values`, shape (walkers, frequencies)."""
        return self.linear_batch(values).frequency_response(
            frequency_hz, self.model.sample_rate_hz, self.model.linear.delay_samples
        )

    def to_model(self, values: FloatArray) -> HammersteinWiener:
        """The model at one parameter vector, shape (parameters,)."""
        batch = self.linear_batch(values[:, None])
        pairs, delay = batch.pair_poles[:, 0], self.model.linear.delay_samples
        poles = np.concatenate([batch.real_poles[:, 0], pairs, pairs.conj()]).astype(np.complex128)
        rate, n_modes = self.model.sample_rate_hz, len(self.model.dominant_modes)
        return replace(
            self.model,
            saturation=replace(self.model.saturation, lower=float(values[0]), upper=float(values[1])),
            dead_zone=replace(self.model.dead_zone, half_width=float(values[2])),
            linear=batch.block(poles, delay),
            dominant_modes=tuple(Mode.from_pole(complex(pole), rate) for pole in pairs[:n_modes]),
            known=tuple(
                one.with_coefficients(values[rows])
                for one, rows in zip(self.model.known, self.known_rows, strict=True)
            ),
        )

    @cached_property
    def known_rows(self) -> list[slice]:
        """Where the coefficients of every known input of the model stand."""
        found = []
        for one in self.model.known:
            first = self._row[f"known.{one.column}.weight1"]
            found.append(slice(first, first + len(one.coefficients)))
        return found

    @cached_property
    def _through_first(self) -> list[int]:
        """The known inputs of the model, those through the load first."""
        return sorted(range(len(self.model.known)), key=lambda i: self.model.known[i].way != TORQUE)

    @cached_property
    def _known_order(self) -> list[int]:
        """The rows of the coefficients in the order of the rows of `known_signals`."""
        every = np.arange(len(self.parameters))
        return [int(row) for i in self._through_first for row in every[self.known_rows[i]]]

    def known_signals(self, known: Mapping[str, FloatArray], samples: int) -> KnownSignals:
        """What a unit of each coefficient of the known inputs adds under the columns `known` of a record.
        Raises InputError where the record lacks one."""
        if not self.model.known:
            return AT_REST
        found = [self.model.known[i] for i in self._through_first]
        rows = [one.signals(known, samples) for one in found]
        through = sum(len(part) for one, part in zip(found, rows, strict=True) if one.way == TORQUE)
        return KnownSignals(np.ascontiguousarray(np.concatenate(rows)), through)

    def known_strengths(self, values: FloatArray) -> dict[str, tuple[FloatArray, str]]:
        """Gain and lag of every known input for every column of `values` (parameters, walkers), by name, with
        their units."""
        found = {}
        for one, rows in zip(self.model.known, self.known_rows, strict=True):
            gain, lag = one.strength(values[rows])
            per_unit = f"{self.model.units.output}/({one.unit})" if one.unit else ""
            found[f"known.{one.column}.gain"] = gain, per_unit
            found[f"known.{one.column}.lag_s"] = lag / self.model.sample_rate_hz, "s"
        return found

    def _known_parameters(self) -> list[Parameter]:
        found = []
        for one in self.model.known:
            largest = np.max(np.abs(one.coefficients) * one.sizes)
            spreads = WEIGHT_SD * largest / np.maximum(one.sizes, NEGLIGIBLE * np.max(one.sizes))
            for i, (value, spread) in enumerate(zip(one.coefficients, spreads, strict=True), start=1):
                name = f"known.{one.column}.weight{i}"
                found.append(_weight(name, "", float(value), float(spread)))
        return found

    def _rows_starting(self, prefix: str) -> list[int]:
        return [row for name, row in self._row.items() if name.startswith(prefix)]

    def _static_parameters(self) -> list[Parameter]:
        model, units = self.model, self.model.units
        lower, upper = model.saturation.lower, model.saturation.upper
        half_width = model.dead_zone.half_width
        scale = DEAD_ZONE_SCALE * half_width if half_width > 0 else 0.05 * self.output_scale
        start = half_width if half_width > 0 else 0.01 * scale
        return [
            Parameter(
                "saturation.lower", units.input, lower, LogNormal(lower, LIMIT_LOG_SD), Logarithm(-1.0)
            ),
            Parameter("saturation.upper", units.input, upper, LogNormal(upper, LIMIT_LOG_SD), Logarithm()),
            Parameter("dead_zone.half_width", units.output, start, HalfNormal(scale), Logarithm()),
        ]

    def _linear_parameters(self) -> list[Parameter]:
        if self.free == "conditional":
            modes = len(self.model.dominant_modes)
            return [_gain("gain", "", self.model.linear.gain), *self._pair_parameters(modes)]
        units = self.model.units
        per_sample = f"{units.output}/({units.input})"
        batch = linear_batch(self.model.linear, 1)
        real, pairs, direct = residues_at(batch.separated(), self._real_poles, self._pair_poles)
        decaying = real if self._integrator is None else np.delete(real, self._integrator)
        weights = np.concatenate([decaying, 2 * np.abs(pairs), np.abs(direct)])
        spread = WEIGHT_SD * float(np.max(np.abs(weights), initial=0.0)) or abs(float(real[0]))
        found: list[Parameter] = []
        if self._integrator is not None:
            gain = float(real[self._integrator]) * self.model.sample_rate_hz
            found.append(_gain("velocity_gain", units.velocity_gain, gain))
        found += self._pair_parameters(len(self._pair_names))
        nested = nested_weights(self._real_poles[self._free_real], real[self._free_real])
        for i, weight in zip(self._free_real, nested, strict=True):
            pole = float(np.clip(self._real_poles[i], -0.999999, 0.999999))
            if f"real_pole{i + 1}" not in self.held_poles:
                found.append(_real_pole(f"real_pole{i + 1}.value", pole))
            found.append(_weight(f"real_pole{i + 1}.weight", per_sample, float(weight), spread))
        for name, residue in zip(self._pair_names, pairs, strict=True):
            found.append(_weight(f"{name}.cosine", per_sample, float(2 * residue.real), spread))
            found.append(_weight(f"{name}.sine", per_sample, float(-2 * residue.imag), spread))
        if len(self.model.linear.zeros) == len(self.model.linear.poles):
            found.append(_weight("direct", per_sample, float(direct[0]), spread))
        return found

    def _pair_parameters(self, count: int) -> list[Parameter]:
        found = []
        for name, pole in zip(self._pair_names[:count], self._pair_poles, strict=False):
            mode = Mode.from_pole(complex(pole), self.model.sample_rate_hz)
            frequency = LogNormal(mode.frequency_hz, FREQUENCY_LOG_SD)
            damping = LogNormal(mode.damping_ratio, DAMPING_LOG_SD)
            found += [
                Parameter(f"{name}.frequency_hz", "Hz", mode.frequency_hz, frequency, Logarithm()),
                Parameter(f"{name}.damping_ratio", "", mode.damping_ratio, damping, Logarithm()),
            ]
        return found


def _real_pole(name: str, pole: float) -> Parameter:
    """A pole by its time constant, or by itself where that is below FASTEST_DECAY samples."""
    if abs(pole) > np.exp(-1 / FASTEST_DECAY):
        median, sign = float(-1 / np.log(abs(pole))), float(np.sign(pole))
        prior = TimeConstant(median, TIME_CONSTANT_LOG_SD, sign)
        return Parameter(name, "", pole, prior, TimeConstantLogarithm(sign))
    return Parameter(name, "", pole, Uniform(-1.0, 1.0), NormalProbability())


def _gain(name: str, unit: str, value: float) -> Parameter:
    if value == 0:
        raise InputError(f"{name}: is zero, so that the output is not moved for good; identify the axis anew")
    return Parameter(name, unit, value, LogNormal(value, GAIN_LOG_SD), Logarithm(float(np.sign(value))))


def _weight(name: str, unit: str, value: float, spread: float) -> Parameter:
    return Parameter(name, unit, value, Normal(value, spread), Identity())
