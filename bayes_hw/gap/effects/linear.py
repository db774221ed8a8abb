"""Effects of the linear block: more delay, a further mode, a torsional spring that is not linear."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.effects.priors import positive, signed
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.parameters import Parameter


class TransportDelay(Effect):
    """u(t - extra): the command arrives later than the model says, by any fraction of a sample.

    Not to be believed where a held encoder or a slower mode would do the same: see timing_jitter.
    """

    label: ClassVar[str] = "transport_delay"
    block: ClassVar[Block] = "linear"
    test_values: ClassVar[tuple[float, ...]] = (1.3,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (positive("transport_delay.samples", "samples", 1.0, 1.0),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.EXTRA_DELAY] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(0.3,), (0.7,), (1.5,), (2.5,), (4.0,), (6.0,)]


class UnmodelledMode(Effect):
    """A resonator on the load: mu s^2 (2 zeta omega s + omega^2) theta / (s^2 + 2 zeta omega s + omega^2).

    A torque; the structural mode that the model lacks acts as a tuned mass (Den Hartog, Mechanical
    Vibrations, 3.2). Not to be believed above half the sample rate.
    """

    label: ClassVar[str] = "unmodelled_mode"
    needs_drive_train: ClassVar[bool] = True
    starts_tried: ClassVar[int] = 3
    block: ClassVar[Block] = "linear"
    test_values: ClassVar[tuple[float, ...]] = (0.3, 1.3, 0.02)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            positive("unmodelled_mode.inertia_ratio", "", 0.2, 1.5),
            positive("unmodelled_mode.frequency_hz", "Hz", 1.2 * scale.first_mode_hz, 0.7),
            positive("unmodelled_mode.damping_ratio", "", 0.02, 0.8),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        """Nothing: the resonator changes the linear block."""

    def resonator(self, values: FloatArray) -> Resonator | None:
        return Resonator(float(values[0]), float(values[1]), float(values[2]))

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        highest = min(0.4 * scale.rate, 6 * scale.first_mode_hz)
        frequencies = np.geomspace(0.25 * scale.first_mode_hz, highest, 18)
        return [(ratio, float(frequency), 0.02) for ratio in (0.05, 0.3, 1.5) for frequency in frequencies]

    def starts_at(self, frequencies_hz: FloatArray) -> Sequence[tuple[float, ...]]:
        """Light and heavy resonators, lightly damped: a narrow one shows only near its own frequency."""
        return [
            (ratio, float(frequency), damping)
            for frequency in frequencies_hz
            for ratio in (0.05, 0.4)
            for damping in (0.007, 0.02)
        ]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return [(ModeOnStructure(), tuple(values))]


class ModeOnStructure(UnmodelledMode):
    """A resonator on the structure that hangs on the load (feed legs, a subreflector), as a tuned mass.

    Den Hartog, Mechanical Vibrations, 3.2; inertia over that of the structure. Not to be believed above half
    the sample rate.
    """

    form: ClassVar[str] = "on the structure"

    def resonator(self, values: FloatArray) -> Resonator | None:
        return Resonator(float(values[0]), float(values[1]), float(values[2]), on_structure=True)

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []


class CubicStiffness(Effect):
    """Spring torque k (phi + cubic phi^3) in the gear compliance, phi its torsion (Duffing's spring).

    Simulated in the drive train read back from G. Not to be believed where G is not that of a drive train.
    """

    label: ClassVar[str] = "cubic_stiffness"
    needs_drive_train: ClassVar[bool] = True
    bends_path: ClassVar[bool] = True
    rugged: ClassVar[bool] = True
    block: ClassVar[Block] = "linear"
    test_values: ClassVar[tuple[float, ...]] = (5e4,)
    starts_tried: ClassVar[int] = 2

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (signed("cubic_stiffness.cubic", f"1/{scale.units.output}^2", 30 * self._usual(scale)),)

    def _usual(self, scale: AxisScale) -> float:
        """The coefficient that doubles the torque at the torsion of steady sweeps, off resonance."""
        torsion = scale.output_speed / np.sqrt(sum(scale.stiffness))
        return float(1 / torsion**2)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.CUBIC] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(factor * self._usual(scale),) for factor in (-0.02, 1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0)]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        """A spring that softens, in the form that keeps its sign: the same for small deflections."""
        return [(SofteningStiffness(), (-float(values[0]),))] if values[0] < 0 else []


class SofteningStiffness(CubicStiffness):
    """Spring torque k phi / (1 + softening phi^2): a gear train that yields under load.

    A softening spring that keeps its sign (Duffing's does not). Not to be believed where G is not that of a
    drive train.
    """

    form: ClassVar[str] = "softening"

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        return (
            positive("cubic_stiffness.softening", f"1/{scale.units.output}^2", 0.1 * self._usual(scale), 3.0),
        )

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        settings[S.CUBIC], settings[S.SOFTENING] = -values[0], values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return [(factor * self._usual(scale),) for factor in (1e-4, 1e-3, 0.02, 0.1, 0.5, 2.0, 10.0)]

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        return []
