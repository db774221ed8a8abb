"""Faults of the readings, found from the residuals of a fit, and the weights that they ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.lattice import STEPS_OF_A_PERIOD
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit
from bayes_hw.gap.joint.fit.structure_moves import pruned, regrown
from bayes_hw.gap.joint.forms.effect_form import JointScale
from bayes_hw.gap.joint.residuals.reading_parts import GLITCHES, PARTS, ROUNDING, Looked

READ_AGAIN = 3
"""Times that readings are looked at again at most: under other weights an explanation is another one."""


@dataclass(frozen=True, eq=False)
class Readings:
    """What the readings' own faults ask of the fit: weights of every record and the nats of each label; the
    step of rounding, whether noise was added after it, and whether what it adds was `taken_off`."""

    weights: tuple[FloatArray, ...]
    nats: dict[str, float]
    step: float | None
    parameters: dict[str, float]
    rounded_first: bool = False
    taken_off: bool = False

    @property
    def shown(self) -> set[str]:
        """Labels and parameters of the faults: one label may be that of several."""
        return {*self.nats, *self.parameters}

    def seen_in(self, scale: JointScale) -> JointScale:
        """With the shortest period in position that is not of the rounding itself."""
        if ROUNDING not in self.nats or self.step is None:
            return scale
        return replace(scale, shortest=STEPS_OF_A_PERIOD * self.step)


def read_faults(fit: JointFit) -> Readings:
    """Rounding, repeats, a rhythm, held angles, glitches and errors of timing, from the residuals of a fit:
    every part looks at what those before it leave."""
    looked = Looked.at(fit)
    for part in PARTS:
        fault = part(looked)
        if fault is not None:
            looked = looked.beside(fault)
    return Readings(
        looked.weights, dict(looked.nats), looked.step, dict(looked.parameters), looked.rounded_first
    )


def glitches_read_again(fit: JointFit, readings: Readings) -> Readings:
    """The faults as a fit under their weights shows them, which glitches have not bent, where there are any;
    what was `taken_off` the readings stays."""
    if GLITCHES not in readings.nats:
        return readings
    again = read_faults(fit)
    if GLITCHES not in again.nats:
        return readings
    if not readings.taken_off:
        return again
    return replace(
        readings,
        weights=again.weights,
        nats={**readings.nats, **again.nats},
        parameters={**readings.parameters, **again.parameters},
    )


def weighted(fit: JointFit, weights: tuple[FloatArray, ...]) -> JointFit:
    """The same explanation under other weights, descended and its G grown on."""
    return regrown(pruned(fit.under(replace(fit.response, weights=weights)).descended()), 3)


def read_again(
    base: AnyFit, fit: AnyFit, readings: Readings, reweighted: Callable[[AnyFit, Readings], AnyFit]
) -> tuple[AnyFit, AnyFit, Readings]:
    """Faults that only an explanation on the way seemed to show are taken back, both fits under the weights
    that are then left, until those under whose weights they are show; what was `taken_off` the readings is no
    longer there to be seen."""
    for _ in range(READ_AGAIN):
        if not readings.nats or readings.taken_off:
            break
        again = read_faults(fit)
        if readings.shown <= again.shown:
            break
        base, fit, readings = reweighted(base, again), reweighted(fit, again), again
    return base, fit, readings
