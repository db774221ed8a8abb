"""Forces that a simulator has no means for, as numbers that compiled code takes.

This module imports nothing of bayes_hw: a corrected simulator that is handed back carries its text.

A door is where a force may enter, with a position x and a speed v. A row of laws holds the kind, the door and
nine numbers, all in the simulator's units:

    FRICTION    F, static excess, Stribeck speed, smoothing speed, asymmetry, viscous, its asymmetry, response
                f = -F (1 + a d) (1 + e exp(-(v / v_s)^2)) clip(v / v_0, -1, 1) - B (1 + b d) v, d = sign v
    BRISTLES    F, static excess, Stribeck speed, stiffness s, 0, 0, 0, response
                f = -s z, z' = v - |v| s z / (F (1 + e exp(-(v / v_s)^2)))
    RIPPLE      A, period, phase, A2, phase2, constant, and as the last number of the row 1 + the door whose
                position it follows, where that is another
                f = A sin(2 pi x / period + phase) + A2 sin(4 pi x / period + phase2) + constant
    HARDENING   stiffness k, b        f = -k b x^3
    SOFTENING   stiffness k, s        f = k x (1 - 1 / (1 + s x^2))
    GAP         stiffness k, half gap f = k clip(x, -half gap, half gap)

Friction is that of the speed at the end of a step, so that what sticks stays: the speed that the step would
end at without it is taken from the acceleration of the step before, less what friction then was. `response`
is the acceleration of the door by a unit force.
"""

from __future__ import annotations

from typing import Any

import numpy as np

try:
    from numba import njit
except ImportError:  # a corrected simulator runs without it, more slowly
    COMPILED = False
else:
    COMPILED = True


def compiled(function: Any) -> Any:
    """The function, compiled where numba is there."""
    return njit(nogil=True, error_model="numpy")(function) if COMPILED else function


FRICTION, BRISTLES, RIPPLE, HARDENING, SOFTENING, GAP = range(6)
LAW_NUMBERS = 11
TURN = 2 * np.pi


@compiled
def law_force(law, x, free, bristle, h):  # type: ignore[no-untyped-def]
    """The force of one law at position x in a step h that would end at speed `free` without it, and its
    bristles' deflection at the end of the step."""
    kind = int(law[0])
    if kind == FRICTION:
        side = 1.0 if free > 0 else -1.0
        level, moved = law[2] * (1 + side * law[6]), h * law[9]
        viscous = moved * law[7] * (1 + side * law[8])
        end, found = free, free
        for _ in range(1 if law[3] == 0 else 6):
            sliding = level
            if law[3] != 0:
                sliding = level * (1 + law[3] * np.exp(-((end / law[4]) ** 2)))
            held = free / (1 + viscous + moved * sliding / law[5])
            slid = (free - side * moved * sliding) / (1 + viscous)
            found = held if abs(held) < law[5] else slid
            end = 0.5 * (end + found)
        return (found - free) / moved, bristle
    if kind == BRISTLES:
        moved, level = h * law[9], law[2]
        if law[3] != 0:
            end = max(abs(free) - moved * law[5] * abs(bristle), 0.0)
            level = law[2] * (1 + law[3] * np.exp(-((end / law[4]) ** 2)))
        bristle = level * (bristle + h * free) / (level + h * law[5] * (abs(free) + moved * level))
        return -law[5] * bristle, bristle
    if kind == RIPPLE:
        angle = TURN * x / law[3]
        return law[2] * np.sin(angle + law[4]) + law[5] * np.sin(2 * angle + law[6]) + law[7], bristle
    if kind == HARDENING:
        return -law[2] * law[3] * x**3, bristle
    if kind == SOFTENING:
        return law[2] * x * (1 - 1 / (1 + law[3] * x * x)), bristle
    return law[2] * min(max(x, -law[3]), law[3]), bristle


@compiled
def forces_of(laws, motion, last, start, before, bristles, h, forces):  # type: ignore[no-untyped-def]
    """Fill `forces` (doors,) with those of the laws at positions and speeds `motion` (doors, 2).

    `last` is what it was a step h ago, `start` at the beginning; they, `before` and `bristles` (laws,) are
    kept for the next step.
    """
    forces[:] = 0.0
    for i in range(len(laws)):
        door = int(laws[i, 1])
        at = int(laws[i, 10]) - 1 if laws[i, 10] > 0 else door
        free = 2 * motion[door, 1] - last[door, 1] - h * laws[i, 9] * before[i]
        x = motion[at, 0] - start[at, 0]
        before[i], bristles[i] = law_force(laws[i], x, free, bristles[i], h)
        forces[door] += before[i]
    for i in range(len(motion)):
        last[i, 0], last[i, 1] = motion[i, 0], motion[i, 1]
