"""A MuJoCo axis in motion: mj_step with forces that MuJoCo has no means for, compiled where numba is.

This module imports nothing of bayes_hw: a corrected simulator that is handed back carries its text.

A door is where a force may enter: position P q - o, speed J v, force entering as J' f. A row of laws holds
the kind, the door and nine numbers, all in the simulator's units:

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

import ctypes
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

try:
    from numba import njit
except ImportError:  # a corrected simulator runs without it, more slowly

    def njit(**_: Any) -> Any:
        """The function as it is."""
        return lambda function: function

    COMPILED = False
else:
    COMPILED = True

FRICTION, BRISTLES, RIPPLE, HARDENING, SOFTENING, GAP = range(6)
LAW_NUMBERS = 11
TURN = 2 * np.pi


def _library() -> Any:
    """MuJoCo's own functions, callable from compiled code."""
    folder = Path(mujoco.__file__).parent
    found = [p for p in sorted(folder.iterdir()) if p.name.startswith(("libmujoco", "mujoco.dll"))]
    return ctypes.CDLL(str(found[0]))


if COMPILED:
    _mj_step, _mj_forward = _library().mj_step, _library().mj_forward
    for _function in (_mj_step, _mj_forward):
        _function.argtypes, _function.restype = [ctypes.c_size_t, ctypes.c_size_t], None
else:
    _mj_step, _mj_forward = mujoco.mj_step, mujoco.mj_forward


@njit(nogil=True, error_model="numpy")
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


@njit(nogil=True, error_model="numpy")
def advance(  # type: ignore[no-untyped-def]
    model,
    data,
    command,
    substeps,
    h,
    actuators,
    loop,
    loop_speed,
    loop_torque,
    positions,
    speeds,
    rests,
    laws,
    read,
    views,
    known,
    y,
):
    """Fill y (samples,) for the command (samples,), in what the actuators or the loop take.

    `loop` holds proportional and integral gain, limit, and whether there is one; it measures `loop_speed` v
    and acts on the actuators, or as a force along `loop_torque` where there are none. `read` holds whether a
    sensor is read, and where the output stands; `known` (samples, doors) forces that are known.
    """
    qpos, qvel, qacc, ctrl, applied, sensors = views
    bristles, before = np.zeros(len(laws)), np.zeros(len(laws))
    integral = 0.0
    alone = len(laws) == 0 and not np.any(known)
    for k in range(len(command)):
        if read[0] == 1:
            _mj_forward(model, data)
            y[k] = sensors[read[1]]
        else:
            y[k] = qpos[read[1]]
        for _ in range(substeps):
            asked = command[k]
            if loop[3] != 0:
                error = asked - np.dot(loop_speed, qvel)
                asked = min(max(loop[0] * error + loop[1] * integral, -loop[2]), loop[2])
                integral += h * error
            for i in range(len(actuators)):
                ctrl[actuators[i]] = asked
            if not alone or len(actuators) == 0:
                applied[:] = 0.0
                if len(actuators) == 0:
                    applied += asked * loop_torque
                for door in range(len(positions)):
                    force = known[k, door]
                    for i in range(len(laws)):
                        if int(laws[i, 1]) == door:
                            at = int(laws[i, 10]) - 1 if laws[i, 10] > 0 else door
                            x = np.dot(positions[at], qpos) - rests[at]
                            free = np.dot(speeds[door], qvel)
                            free += h * (np.dot(speeds[door], qacc) - laws[i, 9] * before[i])
                            before[i], bristles[i] = law_force(laws[i], x, free, bristles[i], h)
                            force += before[i]
                    applied += force * speeds[door]
            _mj_step(model, data)


def run(
    model: Any,
    command: Any,
    substeps: int,
    actuators: Any,
    loop: Any,
    loop_speed: Any,
    loop_torque: Any,
    doors: Any,
    laws: Any,
    read: Any,
    known: Any = None,
) -> Any:
    """What `model` puts out (samples,) for a command (samples,), from its reference position at rest.

    `doors` holds positions (doors, nq), speeds (doors, nv) and rests (doors,); the rest as in `advance`.
    """
    data = mujoco.MjData(model)
    positions, speeds, rests = doors
    y = np.empty(len(command))
    forces = np.zeros((len(command), len(rests))) if known is None else known
    handles = (model._address, data._address) if COMPILED else (model, data)
    views = (data.qpos, data.qvel, data.qacc, data.ctrl, data.qfrc_applied, data.sensordata)
    advance(
        *handles,
        np.ascontiguousarray(command, np.float64),
        substeps,
        float(model.opt.timestep),
        np.asarray(actuators, np.int64),
        np.asarray(loop, np.float64),
        np.asarray(loop_speed, np.float64),
        np.asarray(loop_torque, np.float64),
        np.ascontiguousarray(positions, np.float64),
        np.ascontiguousarray(speeds, np.float64),
        np.asarray(rests, np.float64),
        np.ascontiguousarray(laws, np.float64).reshape(-1, LAW_NUMBERS),
        np.asarray(read, np.int64),
        views,
        forces,
        y,
    )
    return y
