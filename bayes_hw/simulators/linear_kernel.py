"""The compiled motion of a linearised axis with the forces of the catalogue at its doors."""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.gap.simulate import settings as S  # noqa: N812

MOTOR, LOAD, COMPLIANCE = range(3)
TAU = 2 * np.pi


@compiled(nogil=True)
def move_freely(transition, entering, constant, shown, offset, command, y):  # type: ignore[no-untyped-def]
    """Fill y (samples,) of x' = A x + b u + c, y = s x + offset, from rest; one step a sample."""
    count = len(entering)
    x, after = np.zeros(count), np.zeros(count)
    for k in range(len(command)):
        total = offset
        for i in range(count):
            total += shown[i] * x[i]
        y[k] = total
        for i in range(count):
            total = constant[i] + entering[i] * command[k]
            for j in range(count):
                total += transition[i, j] * x[j]
            after[i] = total
        x, after = after, x


@compiled_inside
def _along(row, x):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(len(x)):
        total += row[i] * x[i]
    return total


@compiled_inside
def _wave(x, s, first):  # type: ignore[no-untyped-def]
    """A torque periodic in x, whose settings begin at `first`: both harmonics and the constant."""
    angle = TAU * x / s[first + 1]
    second = s[first + 3] * np.sin(2 * angle + s[first + 4])
    return s[first] * np.sin(angle + s[first + 2]) + second + s[first + 5]


@compiled_inside
def _rubbed(free, bristle, h, level, static, slow, smoothing, stiffness, viscous):  # type: ignore[no-untyped-def]
    """Acceleration by friction in a step that would end at speed `free` without, and the bristle after it.

    Implicit, so that what sticks stays where it is (time stepping of Moreau,
    doi 10.1007/978-3-7091-2624-0_1); `level` is sliding friction, all in output units per s^2 and s.
    """
    if stiffness > 0:
        end = max(abs(free) - h * stiffness * abs(bristle), 0.0)
        at = level * (1 + static * np.exp(-((end / slow) ** 2))) if static != 0 else level
        bristle = at * (bristle + h * free) / (at + h * stiffness * (abs(free) + h * at))
        return -stiffness * bristle, bristle
    side = 1.0 if free > 0 else -1.0
    end, found = free, free
    for _ in range(1 if static == 0 else 6):
        sliding = level * (1 + static * np.exp(-((end / slow) ** 2))) if static != 0 else level
        held = free / (1 + h * (viscous + sliding / smoothing))
        slid = (free - side * h * sliding) / (1 + h * viscous)
        found = held if abs(held) < smoothing else slid
        end = 0.5 * (end + found)
    return (found - free) / h, bristle


@compiled(nogil=True)
def move_with_forces(  # type: ignore[no-untyped-def]
    transition,
    entering,
    constant,
    shown,
    offset,
    command,
    substeps,
    h,
    positions,
    speeds,
    columns,
    rests,
    reaction,
    own,
    s,
    known,
    y,
):
    """The same, `substeps` steps of h a sample, with the forces of the settings s at the doors.

    `positions` and `speeds` (3, states) give those of motor, load and torsion in output units, from `rests`
    (3,); `columns` (3, states) are the changes by a unit acceleration at motor and load, and by the spring's
    own torque at a unit of torsion; `reaction` is the motor's acceleration by a unit of the load's, and `own`
    holds what the simulator has of itself: friction and smoothing speed at motor and load, and a half gap.
    `known` (samples, 2) are accelerations at motor and load.
    """
    count = len(entering)
    x, after = np.zeros(count), np.zeros(count)
    bristles = np.zeros(2)
    rub = np.zeros((2, 7))
    rub[MOTOR] = (
        s[S.MOTOR_FRICTION],
        s[S.MOTOR_STATIC],
        s[S.MOTOR_STRIBECK_SPEED],
        s[S.MOTOR_SMOOTHING],
        s[S.MOTOR_PRESLIDING],
        s[S.VISCOUS],
        s[S.MOTOR_ASYMMETRY],
    )
    rub[LOAD] = (
        s[S.LOAD_FRICTION],
        s[S.LOAD_STATIC],
        s[S.LOAD_STRIBECK_SPEED],
        s[S.LOAD_SMOOTHING],
        s[S.LOAD_PRESLIDING],
        0.0,
        0.0,
    )
    gap = max(s[S.GAP], own[4])
    spring = gap > 0 or s[S.CUBIC] != 0 or s[S.SOFTENING] != 0
    for k in range(len(command)):
        y[k] = _along(shown, x) + offset
        for _ in range(substeps):
            at_motor, at_load, extra = known[k, MOTOR], known[k, LOAD], 0.0
            if s[S.RIPPLE] != 0 or s[S.RIPPLE_START] != 0:
                at_motor += _wave(_along(positions[MOTOR], x) - rests[MOTOR], s, S.RIPPLE)
            if s[S.LOAD_RIPPLE] != 0 or s[S.LOAD_RIPPLE_START] != 0:
                at_load += _wave(_along(positions[LOAD], x) - rests[LOAD], s, S.LOAD_RIPPLE)
            if s[S.MESH_RIPPLE] != 0 or s[S.MESH_RIPPLE_START] != 0:
                meshed = _wave(_along(positions[MOTOR], x) - rests[MOTOR], s, S.MESH_RIPPLE)
                at_load += meshed
                at_motor -= reaction * meshed
            if spring:
                torsion = _along(positions[COMPLIANCE], x) - rests[COMPLIANCE]
                bent = torsion - min(max(torsion, -gap), gap)
                if s[S.SOFTENING] != 0:
                    pull = bent / (1 + s[S.SOFTENING] * bent * bent)
                else:
                    pull = bent * (1 + s[S.CUBIC] * bent * bent)
                extra = torsion - pull
            for i in range(count):
                total = constant[i] + entering[i] * command[k]
                for j in range(count):
                    total += transition[i, j] * x[j]
                total += columns[MOTOR, i] * at_motor + columns[LOAD, i] * at_load
                after[i] = total + columns[COMPLIANCE, i] * extra
            for door in range(2):
                friction = rub[door, 0] + own[2 * door]
                if friction == 0 and rub[door, 5] == 0:
                    continue
                free = _along(speeds[door], after)
                side = 1.0 if free > 0 else -1.0
                level = own[2 * door] + rub[door, 0] * (1 + side * rub[door, 6])
                viscous = rub[door, 5]
                if viscous != 0:
                    viscous *= 1 + side * s[S.VISCOUS_ASYMMETRY]
                smoothing = rub[door, 3] if rub[door, 0] > 0 else own[2 * door + 1]
                force, bristles[door] = _rubbed(
                    free,
                    bristles[door],
                    h,
                    level,
                    rub[door, 1],
                    rub[door, 2],
                    smoothing,
                    rub[door, 4],
                    viscous,
                )
                for i in range(count):
                    after[i] += columns[door, i] * force
            x, after = after, x
