"""The drive train that a model states as "physical", in place of one read back from G.

G stays as given. A torque reaches what turns through the modes of the stated mechanics: where a mode is one
of G, its pole is that of G at the base parameters asked for, and the ratios of its gains are as stated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.gap.simulate.continuous_poles import ContinuousPoles
from bayes_hw.gap.simulate.drive_train import resonant_poles
from bayes_hw.gap.simulate.path import Path, ordered
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.physical import Physical

SAME_POLE = 0.25
"""Distance over modulus within which a pole of the mechanics is one of G."""

SLOWEST = 1e-3
"""rad/s: what poles are set apart by, at least."""


@dataclass(frozen=True, eq=False)
class PhysicalTrain:
    """Modes (n,) of the mechanics, upper ones of pairs: poles in 1/s; `driven` (2, n) by accelerations of
    motor and load; `shown` (3, n) the angles of sensor, motor and load."""

    poles: ComplexArray
    driven: ComplexArray
    shown: ComplexArray
    stiffness: tuple[float, float]
    contact_damping: float

    @classmethod
    def of(cls, physical: Physical, system: ContinuousPoles) -> PhysicalTrain:
        """Raises InputError where a pair of G's poles is not one of the mechanics."""
        values, right = np.linalg.eig(physical.a)
        left = np.linalg.inv(right)
        # What shifts an axis for good has a pole at zero, exactly.
        values = np.where(np.abs(values) < SLOWEST * 1e-3, 0.0, values).astype(np.complex128)
        upper = values.imag >= 0
        driven = (left @ physical.torques * np.array(physical.inertias)).T
        shown = np.stack([physical.sensor, physical.motor, physical.load]) @ right
        k, (motor, load) = physical.stiffness, physical.inertias
        found = cls(
            values[upper], driven[:, upper].astype(np.complex128), shown[:, upper].astype(np.complex128),
            (k / motor, k / load), physical.damping / k,
        )  # fmt: skip
        taken = set(found._numbers(system).tolist())
        for i, pole in enumerate(system.poles):
            if i not in taken and system.real[i] == 0:
                raise InputError(
                    f"physical: has no mode near {abs(pole) / (2 * np.pi):.4g} Hz, which linear has"
                )
        return found

    @cached_property
    def _across(self) -> ComplexArray:
        """(4, n): what `Path` shows but for the speeds' factor s; the twist is motor less sensor there."""
        sensor, motor, load = self.shown
        return np.stack([sensor, sensor + motor - load, motor, load])

    def _numbers(self, system: ContinuousPoles) -> IntArray:
        """For every mode (n,) the number of the pole of G that it is, or -1."""
        distance = np.abs(self.poles[:, None] - system.poles[None, :])
        limit = SAME_POLE * np.abs(self.poles[:, None]) + SLOWEST
        distance = np.where((distance < limit) & self._alike(system), distance, np.inf)
        found = np.full(len(self.poles), -1)
        while np.isfinite(distance).any():
            mode, pole = np.unravel_index(np.argmin(distance), distance.shape)
            found[mode] = pole
            distance[mode], distance[:, pole] = np.inf, np.inf
        return found

    def _alike(self, system: ContinuousPoles) -> BoolArray:
        return (self.poles.imag == 0)[:, None] == (system.real != 0)[None, :]

    def _moved(self, system: ContinuousPoles) -> ComplexArray:
        """Poles (n,) of the modes at these base parameters."""
        numbers = self._numbers(system)
        return np.where(numbers >= 0, system.poles[np.maximum(numbers, 0)], self.poles)

    def torque_path(self, system: ContinuousPoles, resonator: Resonator | None = None) -> Path:  # noqa: ARG002
        """The paths of both torques; without the resonator."""
        s = self._moved(system)
        ones = np.ones_like(s)
        return Path(*ordered(s, self.driven, self._across * np.array([ones, ones, s, s])))

    def command_path(
        self,
        system: ContinuousPoles,
        resonator: Resonator | None,
        torques: Path,  # noqa: ARG002
    ) -> Path:
        """The path from the command: motor and load turn beside the sensor as in the mode of each pole; a
        pole of G that is no mode, such as that of a filter, turns all as one."""
        s, r = system.poles, system.residues
        ratios = np.ones((4, len(s)), dtype=np.complex128)
        for mode, pole in enumerate(self._numbers(system)):
            if pole >= 0 and abs(self.shown[0, mode]) > 0:
                ratios[:, pole] = self._across[:, mode] / self._across[0, mode]
        if resonator is not None:
            s, r, ratios = self._with_resonator(system, resonator, ratios)
        ones = np.ones_like(s)
        return Path(*ordered(s, ones[None], r * ratios * np.array([ones, ones, s, s])))

    def _with_resonator(
        self, system: ContinuousPoles, resonator: Resonator, ratios: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Poles and residues of G with a resonator on the load; all turns as one in the poles that it makes,
        and as the nearest pole of G does in the others."""
        numbers, moved = self._numbers(system), self._moved(system)
        added = numbers < 0
        poles = np.concatenate([system.poles, moved[added]])
        residues = np.concatenate([system.residues, np.zeros(int(added.sum()), dtype=np.complex128)])
        host = np.zeros(len(poles), dtype=np.complex128)
        by_load = self.driven[1] * self.shown[2]
        host[numbers[~added]] = by_load[~added]
        host[len(system.poles) :] = by_load[added]
        real = np.concatenate([system.real != 0, moved[added].imag == 0])
        s, r = resonant_poles(poles, residues, host, real, resonator)
        nearest = np.argmin(np.abs(s[:, None] - system.poles[None, :]), axis=1)
        return s, r, ratios[:, nearest]
