"""Shapes of friction: functions of a speed and of the time since it turned, at the motor and at the load.

Where the gear twists, the motor turns at other times than the load does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.criticism.free_functions import Motion, linear_splines
from bayes_hw.gap.criticism.memories import shapes_after_reversals
from bayes_hw.gap.simulate.builder import SignalChain


def motions_of_the_motor(found: Sequence[Motion], chain: SignalChain, scale: AxisScale) -> list[Motion]:
    """The same with the motor's angle and speed for the load's: ahead of it by the torsion of the gear.

    The load's own where the drive train is not known.
    """
    moved = []
    for motion in found:
        torsion = chain.torsions(motion.limited[:, None])[:, 0]
        speed = motion.speed + np.gradient(torsion) * scale.rate
        moved.append(replace(motion, w=motion.w + torsion, speed=speed))
    return moved


def shapes_of_friction(found: Sequence[Motion], rate: float) -> list[FloatArray]:
    """Shapes (samples, n) a record: the sign of the speed, splines over it, and what follows a reversal."""
    speeds = linear_splines([m.speed for m in found])
    turned = shapes_after_reversals(found, rate)
    signs = [np.sign(m.speed)[:, None] for m in found]
    return [np.concatenate(all_three, axis=1) for all_three in zip(signs, speeds, turned, strict=True)]
