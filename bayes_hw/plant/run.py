"""One record being made: the axis, what the faults have changed in it, and the encoder's reading."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Protocol

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.plant.drive_train import DriveTrain
from bayes_hw.plant.integrator import EXTERNALS, Gear, Physics, Wave, integrate

SLOWEST_STEP_HZ = 1000.0
NO_WAVE = Wave()


class LimitedAxis(Protocol):
    """What a record's commands and readings need of an axis, whatever drives it."""

    @property
    def lower(self) -> float: ...

    @property
    def upper(self) -> float: ...

    @property
    def dead_zone(self) -> float: ...

    @property
    def delay_samples(self) -> int: ...

    @property
    def sample_rate_hz(self) -> float: ...

    @property
    def substeps(self) -> int: ...

    @property
    def step_s(self) -> float: ...


@dataclass(frozen=True)
class Axis:
    """Limiter, drive train and the dead zone of the output; `delay_samples` at `sample_rate_hz`."""

    drive: DriveTrain
    lower: float
    upper: float
    dead_zone: float
    delay_samples: int
    sample_rate_hz: float

    @property
    def substeps(self) -> int:
        """Integration steps in a sample: at least 1 kHz."""
        return max(1, math.ceil(SLOWEST_STEP_HZ / self.sample_rate_hz))

    @property
    def step_s(self) -> float:
        return 1 / (self.sample_rate_hz * self.substeps)


@dataclass
class RecordRun:
    """What happens to one record; the faults change it before its angles are simulated and read.

    Arrays at the integration step have `steps` rows, arrays at the sample rate `samples`. `seed` makes what
    is random in this record.
    """

    axis: LimitedAxis
    command: FloatArray
    seed: tuple[int, ...]
    physics: Physics = field(init=False)
    external: FloatArray = field(init=False)
    extra_delay_s: float = 0.0
    late_s: FloatArray = field(init=False)
    gain_above: float = 1.0
    eccentricity: Wave = NO_WAVE
    sampling_offset_s: FloatArray = field(init=False)
    held: BoolArray = field(init=False)
    repeated: BoolArray = field(init=False)
    stale_every: int = 1
    coarse_step: float = 0.0
    reading_lead: float = 0.0
    drift: FloatArray = field(init=False)
    outliers: FloatArray = field(init=False)
    quantization_step: float = 0.0

    def __post_init__(self) -> None:
        self.physics = Physics(self.axis.lower, self.axis.upper)
        self.external = np.zeros((self.steps, EXTERNALS))
        self.late_s = np.zeros(self.samples)
        self.sampling_offset_s = np.zeros(self.samples)
        self.held = np.zeros(self.samples, dtype=bool)
        self.repeated = np.zeros(self.samples, dtype=bool)
        self.drift = np.zeros(self.samples)
        self.outliers = np.zeros(self.samples)

    @property
    def samples(self) -> int:
        return len(self.command)

    @property
    def steps(self) -> int:
        return self.samples * self.axis.substeps

    @property
    def fine_time(self) -> FloatArray:
        """Time of every integration step in s."""
        return np.arange(self.steps, dtype=np.float64) * self.axis.step_s

    @property
    def time(self) -> FloatArray:
        """Time of every sample in s."""
        return np.arange(self.samples) / self.axis.sample_rate_hz

    @property
    def duration_s(self) -> float:
        return self.samples / self.axis.sample_rate_hz

    def rng(self, stream: int) -> np.random.Generator:
        """Random numbers of this record that no strength changes; one stream a fault."""
        return np.random.default_rng([*self.seed, stream])

    def change(self, **physics: object) -> None:
        """Replace fields of the physics."""
        self.physics = self.physics._replace(**physics)  # type: ignore[arg-type]

    def angles(self) -> FloatArray:
        """The angle in deg of the encoder's disc at every integration step (steps,)."""
        raise NotImplementedError

    def delayed(self) -> FloatArray:
        """The command as it arrives at the limiter, shape (steps,)."""
        delay = self.axis.delay_samples * self.axis.substeps + round(self.extra_delay_s / self.axis.step_s)
        held = np.repeat(self.command, self.axis.substeps)
        command = np.concatenate([np.zeros(min(delay, self.steps)), held])[: self.steps]
        return self._late(command) if self.late_s.any() else command

    def _late(self, command: FloatArray) -> FloatArray:
        """The latest of a command (steps,) that has arrived, those of every sample `late_s` late."""
        late = np.interp(self.fine_time, self.time, self.late_s) / self.axis.step_s
        arrived = np.maximum.accumulate(np.arange(self.steps) - np.round(late).astype(np.int64))
        return np.where(arrived < 0, 0.0, command[np.maximum(arrived, 0)])

    def read(self, angles: FloatArray) -> Reading:
        """What the encoder shows of these angles, without noise."""
        w = self._sample(angles)
        if self.reading_lead != 0.0:
            speed = np.gradient(w, 1 / self.axis.sample_rate_hz)
            w = w + self.reading_lead * speed * np.abs(speed)
        if self.coarse_step > 0.0:
            w = _stale_interpolation(w, self.coarse_step, self.stale_every)
        above = self.gain_above * np.maximum(w - self.axis.dead_zone, 0.0)
        y = above + np.minimum(w + self.axis.dead_zone, 0.0)
        wave = self.eccentricity
        if wave.amplitude != 0.0:
            x = wave.wavenumber * w
            error = np.sin(x + wave.phase) + wave.second * np.sin(2 * x + wave.phase)
            y = y + wave.amplitude * (error - (1 + wave.second) * np.sin(wave.phase))
        y = y[_last_fresh(self.held)]
        return Reading(y, self.drift, self.outliers, self.repeated, self.quantization_step)

    def _sample(self, angles: FloatArray) -> FloatArray:
        if not self.sampling_offset_s.any():
            return np.asarray(angles[:: self.axis.substeps], dtype=np.float64).copy()
        return np.asarray(
            np.interp(self.time + self.sampling_offset_s, self.fine_time, angles), dtype=np.float64
        )


@dataclass
class Run(RecordRun):
    """A record of the plant's own drive train."""

    axis: Axis
    drive: DriveTrain = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.drive = self.axis.drive

    def angles(self) -> FloatArray:
        """The axis angle after any play, at every integration step, shape (steps,)."""
        transition, forcing = _step_matrices(self.drive, self.axis.step_s)
        command = self.delayed()
        drive = self.drive
        gear = Gear(
            drive.stiffness,
            drive.gear_damping,
            drive.loop_gain,
            drive.loop_integral_gain,
            drive.velocity_gain,
        )
        quiet = not self.external.any()
        external = self.external[:1] if quiet else self.external
        return integrate(transition, forcing, command, external, self.physics, gear, self.axis.step_s)


@dataclass(frozen=True, eq=False)
class Reading:
    """An encoder's record before its noise, and what it adds to it.

    `angle` is what the axis does as the encoder sees it at its instants; drift, isolated glitches, repeats of
    whole readings and rounding come on top of it in `measured`.
    """

    angle: FloatArray
    drift: FloatArray
    outliers: FloatArray
    repeated: BoolArray
    quantization_step: float

    @property
    def noise_free(self) -> FloatArray:
        """The angle at the instants of which readings are shown, those that are repeated too."""
        return np.asarray(self.angle[_last_fresh(self.repeated)], dtype=np.float64)

    def measured(self, noise: FloatArray | float = 0.0) -> FloatArray:
        """The record with this noise."""
        y = self.angle + self.drift + self.outliers + noise
        if self.quantization_step > 0.0:
            y = self.quantization_step * np.round(y / self.quantization_step)
        return np.asarray(y[_last_fresh(self.repeated)], dtype=np.float64)


@lru_cache(maxsize=64)
def _step_matrices(drive: DriveTrain, step_s: float) -> tuple[FloatArray, FloatArray]:
    return drive.step_matrices(step_s)


def _last_fresh(stale: BoolArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """For every sample the index of the last one that is not stale."""
    index = np.where(stale, 0, np.arange(len(stale)))
    return np.maximum.accumulate(index)


def _stale_interpolation(w: FloatArray, coarse_step: float, every: int) -> FloatArray:
    """Coarse lines of every sample with the fine interpolation of every `every`-th one."""
    coarse = coarse_step * np.floor(w / coarse_step)
    fine = w - coarse
    return np.asarray(coarse + fine[np.arange(len(w)) // every * every], dtype=np.float64)
