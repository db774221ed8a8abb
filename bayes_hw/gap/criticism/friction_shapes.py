"""Shapes of friction: functions of a speed and of the time since it turned, at the motor and at the load.

Where the gear twists, the motor turns at other times than the load does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.criticism.free_functions import Motion, hats
from bayes_hw.gap.criticism.memories import shapes_after_reversals
from bayes_hw.gap.simulate.builder import SignalChain
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.small_signals import torsions


def motions_of_the_motor(found: Sequence[Motion], chain: SignalChain, scale: AxisScale) -> list[Motion]:
    """The same with the motor's angle and speed for the load's: ahead of it by the torsion of the gear.

    The load's own where the drive train is not known.
    """
    if not isinstance(chain, Chain):
        return list(found)
    moved = []
    for motion in found:
        torsion = torsions(chain, motion.limited[:, None])[:, 0]
        speed = motion.speed + np.gradient(torsion) * scale.rate
        moved.append(replace(motion, w=motion.w + torsion, speed=speed))
    return moved


def shapes_of_friction(found: Sequence[Motion], rate: float) -> list[FloatArray]:
    """Shapes (samples, n) a record: the sign of the speed, hats over it, and what follows a reversal."""
    speeds = hats([m.speed for m in found])
    turned = shapes_after_reversals(found, rate)
    signs = [np.sign(m.speed)[:, None] for m in found]
    return [np.concatenate(all_three, axis=1) for all_three in zip(signs, speeds, turned, strict=True)]
