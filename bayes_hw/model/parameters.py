"""The parameter vector of a Hammerstein-Wiener axis: names, units, priors and transforms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import INTEGRATOR_RADIUS, LinearBlock, Mode, mode_pole, polynomial_roots
from bayes_hw.model.modal import LinearBatch, ModalForm, modal_form
from bayes_hw.model.priors import (
    HalfNormal,
    HyperbolicTangent,
    Identity,
    Logarithm,
    LogNormal,
    Normal,
    Prior,
    Transform,
    Uniform,
)

FreeSet: TypeAlias = Literal["dominant", "all"]
FREE_SETS: tuple[FreeSet, ...] = ("dominant", "all")

LIMIT_LOG_SD = 0.3
GAIN_LOG_SD = 0.3
FREQUENCY_LOG_SD = 0.1
DAMPING_LOG_SD = 0.8
DEAD_ZONE_SCALE = 3.0
NUMERATOR_SD = 1.0
MEMORY_RADIUS = 0.5
"""Poles inside this radius forget their state within a few samples: no initial state is given to them."""


@dataclass(frozen=True)
class Parameter:
    """One scalar parameter; `nominal` is its value in the model that the prior is centred on."""

    name: str
    unit: str
    nominal: float
    prior: Prior
    transform: Transform


def as_coordinates(parameters: tuple[Parameter, ...], values: FloatArray) -> FloatArray:
    """Values of shape (parameters, ...) in unbounded coordinates."""
    return np.stack([p.transform.to_coordinate(v) for p, v in zip(parameters, values, strict=True)])


def as_values(parameters: tuple[Parameter, ...], coordinates: FloatArray) -> FloatArray:
    """Coordinates of shape (parameters, ...) as parameter values."""
    return np.stack([p.transform.to_value(q) for p, q in zip(parameters, coordinates, strict=True)])


def log_prior(parameters: tuple[Parameter, ...], coordinates: FloatArray) -> FloatArray:
    """Log-density of the prior in coordinates (Jacobian included), shape of one coordinate."""
    total = np.zeros_like(coordinates[0])
    for parameter, coordinate in zip(parameters, coordinates, strict=True):
        value = parameter.transform.to_value(coordinate)
        total = total + parameter.prior.log_density(value)
        total = total + parameter.transform.log_jacobian(coordinate)
    return total


@dataclass(frozen=True)
class _Slot:
    """Where a parameter of G goes: the kind of root and its position among the roots of that kind."""

    kind: Literal["mode", "pole_pair", "real_pole"]
    position: int


class AxisParameters:
    """Which numbers of a Hammerstein-Wiener model are free, and how a vector of them becomes a model.

    `free` is "dominant" (saturation limits, dead zone, gain, dominant modes; the other roots of G are held)
    or "all" (every pole and zero of G but an integrator is free as well). With `free_start` the initial
    position and the free response of every slow pole are parameters of each of the `records` records, named
    `start<record>.<what>`, in output units.
    """

    def __init__(
        self,
        model: HammersteinWiener,
        free: FreeSet = "dominant",
        *,
        output_scale: float = 1.0,
        start_positions: FloatArray | None = None,
    ) -> None:
        """`output_scale` is the size of the output, (output units): it scales the prior of a dead zone whose
        nominal width is zero, and the priors of the initial states. `start_positions` holds the measured
        first output of every record when the initial conditions are free, else None (rest at w = 0).
        """
        self.model = model
        self.free: FreeSet = free
        self.output_scale = output_scale
        self.start_positions = start_positions
        poles, zeros = model.linear.poles, model.linear.zeros
        self._real_poles = np.sort(poles[poles.imag == 0].real)
        integrators = np.flatnonzero(np.abs(self._real_poles - 1) <= INTEGRATOR_RADIUS)
        self._integrator = int(integrators[0]) if integrators.size else None
        dominant = model.mode_indices()
        others = [int(i) for i in np.flatnonzero(poles.imag > 0) if i not in dominant]
        others.sort(key=lambda i: abs(np.log(poles[i])))
        self._pair_poles = poles[[*dominant, *others]]
        self._n_modes = len(dominant)
        self._numerator = model.linear.gain * np.atleast_1d(np.real(np.poly(zeros)))
        self._slots: list[tuple[_Slot, int]] = []
        structure = [*self._static_parameters(), *self._linear_parameters()]
        self._n_structure = len(structure)
        starts = [] if start_positions is None else self._start_parameters(start_positions)
        self.parameters: tuple[Parameter, ...] = (*structure, *starts)
        self._interchangeable = [
            [row for slot, row in self._slots if slot.kind == kind]
            for kind in ("mode", "pole_pair", "real_pole")
        ]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def nominal(self) -> FloatArray:
        """Values of the nominal model, shape (parameters,)."""
        return np.array([parameter.nominal for parameter in self.parameters])

    def in_order(self, values: FloatArray) -> FloatArray:
        """Whether modes, other pole pairs and real poles keep the order that gives them their numbers.

        Exchanging two poles of a kind changes nothing but their names. For values (parameters, walkers).
        """
        kept = np.ones(values.shape[1], dtype=np.bool_)
        for rows in self._interchangeable:
            kept &= np.all(np.diff(values[rows], axis=0) > 0, axis=0)
        return kept

    def modal_form(self, values: FloatArray, record: int = 0) -> ModalForm:
        """The modal form of every column of `values` (parameters, walkers), started as record `record`."""
        linear = self._linear_batch(values)
        gains = self.model.normalization
        ones = np.ones(values.shape[1])
        static = np.stack(
            [values[0], values[1], gains.c1 * ones, values[2], gains.c2 * ones, gains.c3 * ones]
        )
        form = modal_form(linear, static)
        if self.start_positions is None:
            return form
        return self._with_start(form, linear, values, record)

    def velocity_gain(self, values: FloatArray) -> FloatArray:
        """Steady output velocity per unit of v for every column of `values`; NaN without an integrator."""
        if self._integrator is None:
            return np.full(values.shape[1], np.nan)
        residues, _, _ = self._linear_batch(values).separated().residues()
        return residues[self._integrator] * self.model.sample_rate_hz

    def frequency_response(self, values: FloatArray, frequency_hz: FloatArray) -> ComplexArray:
        """G at every frequency for every column of `values`, shape (walkers, frequencies)."""
        linear = self.model.linear
        return self._linear_batch(values).frequency_response(
            frequency_hz, self.model.sample_rate_hz, linear.delay_samples
        )

    def to_model(self, values: FloatArray) -> HammersteinWiener:
        """The model at one parameter vector, shape (parameters,)."""
        batch = self._linear_batch(values[:, None])
        pairs = batch.pair_poles[:, 0]
        poles = np.concatenate([batch.real_poles[:, 0], pairs, pairs.conj()]).astype(np.complex128)
        zeros = batch.zeros[:, 0] if batch.numerator is None else polynomial_roots(batch.numerator[:, 0])
        linear = LinearBlock(zeros, poles, float(batch.gain[0]), self.model.linear.delay_samples)
        rate = self.model.sample_rate_hz
        return replace(
            self.model,
            saturation=replace(self.model.saturation, lower=float(values[0]), upper=float(values[1])),
            dead_zone=replace(self.model.dead_zone, half_width=float(values[2])),
            linear=linear,
            dominant_modes=tuple(Mode.from_pole(complex(pole), rate) for pole in pairs[: self._n_modes]),
        )

    def _static_parameters(self) -> list[Parameter]:
        model, units = self.model, self.model.units
        lower, upper = model.saturation.lower, model.saturation.upper
        half_width, gain = model.dead_zone.half_width, model.linear.gain
        scale = DEAD_ZONE_SCALE * half_width if half_width > 0 else 0.05 * self.output_scale
        start = half_width if half_width > 0 else 0.01 * scale
        return [
            Parameter(
                "saturation.lower", units.input, lower, LogNormal(lower, LIMIT_LOG_SD), Logarithm(-1.0)
            ),
            Parameter("saturation.upper", units.input, upper, LogNormal(upper, LIMIT_LOG_SD), Logarithm()),
            Parameter("dead_zone.half_width", units.output, start, HalfNormal(scale), Logarithm()),
            Parameter("gain", "", gain, LogNormal(gain, GAIN_LOG_SD), Logarithm(float(np.sign(gain)))),
        ]

    def _linear_parameters(self) -> list[Parameter]:
        found: list[Parameter] = []
        rate = self.model.sample_rate_hz
        for position, pole in enumerate(self._pair_poles):
            is_mode = position < self._n_modes
            if not is_mode and self.free == "dominant":
                continue
            kind: Literal["mode", "pole_pair"] = "mode" if is_mode else "pole_pair"
            number = position + 1 if is_mode else position - self._n_modes + 1
            found += self._pair(f"{kind}{number}", _Slot(kind, position), pole, rate)
        if self.free == "dominant":
            return found
        for position, value in enumerate(self._real_poles):
            if abs(value - 1) > INTEGRATOR_RADIUS:
                self._slots.append((_Slot("real_pole", position), 4 + len(found)))
                found.append(
                    Parameter(
                        f"real_pole{position + 1}", "", float(value), Uniform(-1.0, 1.0),
                        HyperbolicTangent(),
                    )
                )  # fmt: skip
        self._numerator_row = 4 + len(found)
        spread = NUMERATOR_SD * float(np.max(np.abs(self._numerator)))
        for power, value in enumerate(self._numerator[1:], start=1):
            prior = Normal(float(value), spread)
            found.append(Parameter(f"numerator{power}", "", float(value), prior, Identity()))
        return found

    def _pair(self, name: str, slot: _Slot, pole: complex, rate: float) -> list[Parameter]:
        mode = Mode.from_pole(complex(pole), rate)
        self._slots.append((slot, 4 + 2 * slot.position))
        return [
            Parameter(
                f"{name}.frequency_hz", "Hz", mode.frequency_hz,
                LogNormal(mode.frequency_hz, FREQUENCY_LOG_SD), Logarithm(),
            ),
            Parameter(
                f"{name}.damping_ratio", "", mode.damping_ratio,
                LogNormal(mode.damping_ratio, DAMPING_LOG_SD), Logarithm(),
            ),
        ]  # fmt: skip

    def _linear_batch(self, values: FloatArray) -> LinearBatch:
        walkers = values.shape[1]
        real_poles = np.repeat(self._real_poles[:, None], walkers, axis=1)
        pairs = np.repeat(self._pair_poles[:, None], walkers, axis=1)
        for slot, row in self._slots:
            if slot.kind in ("mode", "pole_pair"):
                pairs[slot.position] = mode_pole(
                    values[row], np.minimum(values[row + 1], 0.999), self.model.sample_rate_hz
                )
            else:
                real_poles[slot.position] = values[row]
        zeros = np.repeat(self.model.linear.zeros[:, None], walkers, axis=1)
        if self.free == "dominant":
            return LinearBatch(real_poles, pairs, zeros, values[3])
        first = self._numerator_row
        numerator = values[[3, *range(first, first + len(self._numerator) - 1)]]
        return LinearBatch(real_poles, pairs, zeros, values[3], numerator)

    def _slow_real_poles(self) -> list[int]:
        return [
            i
            for i, pole in enumerate(self._real_poles)
            if abs(pole) > MEMORY_RADIUS and abs(pole - 1) > INTEGRATOR_RADIUS
        ]

    def _slow_pairs(self) -> list[int]:
        return [i for i, pole in enumerate(self._pair_poles) if abs(pole) > MEMORY_RADIUS]

    def _start_parameters(self, positions: FloatArray) -> list[Parameter]:
        found: list[Parameter] = []
        unit, scale = self.model.units.output, self.output_scale
        for record, position in enumerate(positions, start=1):
            offset = np.sign(position) * self.model.dead_zone.half_width
            centre = float(position + offset)
            parts = [("position", centre, Normal(centre, scale))] if self._integrator is not None else []
            parts += [(f"real_pole{i + 1}", 0.0, Normal(0.0, 0.1 * scale)) for i in self._slow_real_poles()]
            for i in self._slow_pairs():
                parts += [
                    (f"pair{i + 1}.{part}", 0.0, Normal(0.0, 0.1 * scale)) for part in ("cosine", "sine")
                ]
            found += [
                Parameter(f"start{record}.{name}", unit, value, prior, Identity())
                for name, value, prior in parts
            ]
        return found

    def _with_start(self, form: ModalForm, linear: LinearBatch, values: FloatArray, record: int) -> ModalForm:
        """Fill the initial states so that the free response is the one that the parameters describe.

        A real pole p with free response a p^k has x(0) = a / residue; a pair with Re((A - iB) p^k) has
        s(k) = Re(C p^k) with C = (A - iB) p^2 / (b1 p + b2).
        """
        slow_real, slow_pairs = self._slow_real_poles(), self._slow_pairs()
        real = slow_real if self._integrator is None else [self._integrator, *slow_real]
        per_record = len(real) + 2 * len(slow_pairs)
        begin = self._n_structure + record * per_record
        start = values[begin : begin + per_record]
        real_state, pair_state = form.real_state.copy(), form.pair_state.copy()
        for row, index in enumerate(real):
            real_state[index] = start[row] / form.real[1, index]
        for number, index in enumerate(slow_pairs):
            row = len(real) + 2 * number
            pole: ComplexArray = linear.pair_poles[index]
            b1, b2 = form.pairs[2, index], form.pairs[3, index]
            amplitude = (start[row] - 1j * start[row + 1]) * pole**2 / (b1 * pole + b2)
            pair_state[0, index] = (amplitude / pole).real
            pair_state[1, index] = (amplitude / pole**2).real
        return replace(form, real_state=real_state, pair_state=pair_state)
