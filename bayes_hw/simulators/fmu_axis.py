"""An axis in a functional mock-up unit (FMI 2 or 3, co-simulation): linear system by pulses, and motion.

A linear system from responses to pulses: the eigensystem realisation, with bases that stay.

From the responses P(k) (outputs, inputs) to a pulse a step long, H0 holds P(i + j + 1) and H1 P(i + j + 2) at
chosen times i and j. With U and V of the singular value decomposition of H0 at one system, any system near it
of the same order has, in coordinates of its own,

    A = (U' H0 V)^-1 U' H1 V,   B = (U' H0 V)^-1 U' H0 e,   C = e' H0 V,

e the first block of columns or rows (eigensystem realisation: Juang and Pappa, doi 10.2514/3.20031).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from threading import Lock

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.gap.case.simulator import Force, command_of
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, LogNormal
from bayes_hw.simulators.declaration import Declaration
from bayes_hw.simulators.door_forces import DoorPlace, door_laws
from bayes_hw.simulators.linear_axis import LinearSystem
from bayes_hw.simulators.linear_kernel import LOAD, MOTOR
from bayes_hw.simulators.stepped_axis import SteppedAxis

SMALLEST_SHARE = 1e-9
"""Of the largest singular value: what is below it is taken for the arithmetic of the simulator."""

LARGEST_ORDER = 16
BLOCKS = 40
"""Times of rows, and of columns, of the Hankel matrices."""


@dataclass(frozen=True)
class Realisation:
    """Bases of the Hankel matrices of responses (steps, outputs, inputs), scaled to one size."""

    left: FloatArray
    right: FloatArray
    output_scales: FloatArray
    input_scales: FloatArray

    @classmethod
    def of(cls, responses: FloatArray) -> Realisation:
        """From one system's responses."""
        outputs = 1 / np.maximum(np.max(np.abs(responses), axis=(0, 2)), 1e-300)
        scaled = responses * outputs[:, None]
        inputs = 1 / np.maximum(np.max(np.abs(scaled), axis=(0, 1)), 1e-300)
        hankel, _ = _hankel(scaled * inputs)
        left, sizes, right = np.linalg.svd(hankel, full_matrices=False)
        order = min(int(np.sum(sizes > SMALLEST_SHARE * sizes[0])), LARGEST_ORDER)
        bases = np.asarray(left[:, :order], np.float64), np.asarray(right[:order].T, np.float64)
        return cls(*bases, np.asarray(outputs), np.asarray(inputs))

    def system(self, responses: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (order, order), B (order, inputs) and C (outputs, order) of a system near that of the bases."""
        _, outputs, inputs = responses.shape
        scaled = responses * self.output_scales[:, None] * self.input_scales
        first, second = _hankel(scaled)
        middle = self.left.T @ first @ self.right
        transition = np.linalg.solve(middle, self.left.T @ second @ self.right)
        entering = np.linalg.solve(middle, self.left.T @ first[:, :inputs]) / self.input_scales
        shown = (first[:outputs] @ self.right) / self.output_scales[:, None]
        return np.asarray(transition, np.float64), np.asarray(entering, np.float64), np.asarray(shown)

    def error(self, responses: FloatArray, steps: int) -> float:
        """How far responses are from those of the system that their first steps tell, the largest being 1."""
        transition, state, shown = self.system(responses[:steps])
        off = np.zeros(responses.shape[1:])
        for response in responses[1:]:
            off = np.maximum(off, np.abs(response - shown @ state))
            state = transition @ state
        return float(np.max(off / np.maximum(np.abs(responses).max(axis=0), 1e-300)))


def _hankel(responses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """H0 and H1 at BLOCKS times of rows and of columns, from the responses at steps 1 and later."""
    times = _times(len(responses))
    blocks = len(times)
    return tuple(  # type: ignore[return-value]
        np.ascontiguousarray(
            responses[times + shift]
            .transpose(0, 2, 1, 3)
            .reshape(blocks * responses.shape[1], blocks * responses.shape[2])
        )
        for shift in (1, 2)
    )


def _times(steps: int) -> IntArray:
    """Those of the blocks (blocks, blocks) within so many steps, less one."""
    stride = max(1, (steps - 3) // (2 * (BLOCKS - 1)))
    blocks = min(BLOCKS, (steps - 3) // (2 * stride) + 1)
    return np.asarray(stride * (np.arange(blocks)[:, None] + np.arange(blocks)[None, :]))


def _looked_at(steps: int) -> BoolArray:
    """Which steps (steps,) of a response the Hankel matrices hold."""
    found = np.zeros(steps, dtype=np.bool_)
    for shift in (1, 2):
        found[_times(steps) + shift] = True
    return found


PULSES_S = (0.5, 1.0, 2.0, 5.0)
"""Times over which the responses to pulses may be taken: the shortest that tells the longest is."""

TELLS = 1e-8
"""Of the largest response: what those of a realisation may be off."""

PLACES = {"motor": MOTOR, "load": LOAD}


class FmuAxis(SteppedAxis):
    """A `SimulatorFile` that is an FMU; commands, outputs and forces in the record's units.

    One instance is simulated at a time. Raises InputError where FMPy is not installed or cannot read the
    file, and where the declaration names a variable that is not there.
    """

    def __init__(self, path: Path, declaration: Declaration) -> None:
        try:
            from bayes_hw.simulators.unit_loop import Unit
        except ImportError:
            raise InputError(f"{path}: FMPy is not installed; pip install bayes-hw[fmu]") from None
        super().__init__(path, declaration)
        try:
            self.unit = Unit(path)
        except Exception as error:
            said = " ".join(str(error).split())
            raise InputError(f"{path}: FMPy cannot open it ({said}); give a co-simulation FMU") from None
        self._one_at_a_time = Lock()
        self.step_s, self.substeps = self._steps()
        (kind, self.output), *_ = declaration.measured.items()
        if kind != "variable":
            raise InputError(f"{declaration.path}: measured.{kind} is for MuJoCo; give variable")
        for name in (*declaration.actuators, self.output):
            self._check(name, "command.variables" if name != self.output else "measured.variable")
        if declaration.loop is not None:
            raise InputError(f"{declaration.path}: loop: is for MuJoCo; give an FMU that has its own")
        self.doors_of: dict[str, tuple[str, str, str]] = {}
        self.ratios: dict[str, float] = {}
        for door in declaration.doors:
            where = f"forces.{door.name}"
            if door.name == "compliance" or not (door.input and door.position and door.speed):
                raise InputError(
                    f"{declaration.path}: {where}: of an FMU give motor or load, with input, position and "
                    "speed"
                )
            for name in (door.input, door.position, door.speed):
                self._check(name, where)
            self.doors_of[door.name] = (door.input, door.position, door.speed)
            self.ratios[door.name] = door.ratio
        self.parameters: tuple[Parameter, ...] = tuple(self._parameters())

    def _steps(self) -> tuple[float, int]:
        """Communication step, s, and how many there are in a sample."""
        experiment = self.unit.description.defaultExperiment
        wanted = self.declaration.step_s
        if not wanted > 0:
            given = getattr(experiment, "stepSize", None) if experiment is not None else None
            wanted = float(given) if given else 1 / self.sample_rate_hz
        steps = max(1, round(1 / (wanted * self.sample_rate_hz)))
        if abs(1 / (wanted * self.sample_rate_hz * steps) - 1) > 1e-6:
            raise InputError(
                f"{self.declaration.path}: record.step_s: {wanted:g} s is no whole part of a sample at "
                f"{self.sample_rate_hz:g} Hz"
            )
        return wanted, steps

    def _check(self, name: str, where: str) -> None:
        if name not in self.unit.references:
            known = ", ".join(list(self.unit.references)[:30])
            raise InputError(
                f"{self.declaration.path}: {where}: no variable {name!r} in the FMU; it has: {known}"
            )

    def _parameters(self) -> list[Parameter]:
        found = []
        starts = {v.name: v.start for v in self.unit.description.modelVariables}
        for uncertain in self.declaration.uncertain:
            self._check(uncertain.parameter, "uncertain.parameter")
            try:
                nominal = float(starts[uncertain.parameter])
            except (TypeError, ValueError):
                nominal = float("nan")
            if not nominal > 0:
                raise InputError(
                    f"{self.declaration.path}: uncertain.parameter {uncertain.parameter!r}: has no positive "
                    "start value in the FMU, about which relative_sd can spread; give it one"
                )
            prior = LogNormal(nominal, uncertain.relative_sd)
            found.append(Parameter(uncertain.parameter, "", nominal, prior, Logarithm()))
        return found

    @property
    def doors(self) -> frozenset[str]:
        """Those that it has."""
        return frozenset(self.doors_of)

    def named(self, values: FloatArray) -> dict[str, float]:
        """Parameter values (parameters,) by the names of variables."""
        return dict(zip((p.name for p in self.parameters), values.tolist(), strict=True))

    def _responses(self, values: FloatArray, steps: int, looked_at: BoolArray | None = None) -> FloatArray:
        """Responses (steps, outputs, inputs) to unit pulses a step long of the command and of every force, of
        the output and of every position and speed, less the motion with none; zero but where `looked_at`."""
        outputs = [self.output, *(name for door in self.doors_of.values() for name in door[1:])]
        inputs = [self.declaration.actuators, *((door[0],) for door in self.doors_of.values())]
        everything = [name for group in inputs for name in group]
        runs = []
        for group in (*inputs, ()):
            signals = {name: np.zeros(steps) for name in everything}
            for name in group:
                signals[name][0] = 1.0
            with self._one_at_a_time:
                runs.append(
                    self.unit.run(self.named(values), signals, outputs, 1, self.step_s, shown=looked_at)
                )
        rest = runs[-1]
        return np.stack([run - rest for run in runs[:-1]], axis=2)

    @cached_property
    def bases(self) -> tuple[Realisation, int]:
        """Of the responses at the nominal parameters, and the steps that they are to be taken over."""
        nominal = np.array([p.nominal for p in self.parameters])
        counts = [max(round(seconds / self.step_s), 100) for seconds in PULSES_S]
        responses = self._responses(nominal, counts[-1])
        for steps in counts:
            found = Realisation.of(responses[:steps])
            if steps == counts[-1] or found.error(responses, steps) < TELLS:
                break
        return found, steps

    def linearised(self, values: FloatArray) -> LinearSystem:
        """The linear system at parameter values (parameters,), by the eigensystem realisation."""
        bases, steps = self.bases
        transition, entering, shown = bases.system(self._responses(values, steps, _looked_at(steps)))
        factor, count = self.declaration.output_factor, len(transition)
        positions, speeds, columns = (np.zeros((3, count)) for _ in range(3))
        inertia = np.ones(2)
        for number, name in enumerate(self.doors_of):
            door, scale = PLACES[name], factor / self.ratios[name]
            positions[door] = scale * shown[1 + 2 * number]
            speeds[door] = scale * shown[2 + 2 * number]
            column = entering[:, 1 + number]
            inertia[door] = self.step_s / float(speeds[door] @ column)
            columns[door] = column * inertia[door]
        reaction = 0.0
        if {"motor", "load"} <= self.doors:
            reaction = float(inertia[LOAD] / inertia[MOTOR] * self.ratios["load"] / self.ratios["motor"])
        return LinearSystem(
            np.ascontiguousarray(transition),
            np.ascontiguousarray(entering[:, 0]) * self.declaration.input_factor,
            np.zeros(count),
            np.ascontiguousarray(factor * shown[0]),
            0.0,
            self.step_s,
            positions,
            speeds,
            columns,
            np.zeros(3),
            reaction,
            np.array([0.0, 1.0, 0.0, 1.0, 0.0]),
            inertia,
            0.0,
        )

    def laws_of(self, values: FloatArray, settings: FloatArray) -> FloatArray:
        """The forces of settings (COUNT,) at parameter values (parameters,) as laws."""
        system = self.linear.system(values)
        places = {
            name: DoorPlace(
                "unit",
                name,
                index,
                self.declaration.output_factor / self.ratios[name],
                float(system.inertia[PLACES[name]]),
            )
            for index, name in enumerate(self.doors_of)
        }
        return door_laws(settings, places, system)

    def motion(
        self, values: FloatArray, command: FloatArray, laws: FloatArray, known: FloatArray | None = None
    ) -> FloatArray:
        """Output (samples,) for a command (samples,), both in the record's units, from the start at zero."""
        scaled = np.asarray(command, np.float64) * self.declaration.input_factor
        inputs = dict.fromkeys(self.declaration.actuators, scaled)
        doors = list(self.doors_of.values())
        with self._one_at_a_time:
            (*_, y) = self.unit.run(
                self.named(values), inputs, [self.output], self.substeps, self.step_s, doors, laws, known
            ).T
        return np.asarray((y - y[0]) * self.declaration.output_factor)

    def write_corrected(self, diagnosis: Diagnosis, folder: Path, rng: np.random.Generator) -> None:
        """See `corrected_fmu`."""
        from bayes_hw.simulators.corrected_fmu import write_corrected

        write_corrected(self, diagnosis, folder, rng)

    def simulate(self, values: FloatArray, inputs: FloatArray, force: Force | None = None) -> FloatArray:
        """Outputs (batch, samples) for values (batch, parameters) and inputs as `LinearAxis` takes them."""
        settings = np.tile(S.NEUTRAL, (len(values), 1)) if force is None else force.settings
        signal = None if force is None else force.signal
        found = []
        for row, at in enumerate(values):
            known = self.forces_at(list(self.doors_of), at, inputs, signal)
            found.append(self.motion(at, command_of(inputs), self.laws_of(at, settings[row]), known))
        return np.array(found)
