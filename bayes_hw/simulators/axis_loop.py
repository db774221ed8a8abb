"""A MuJoCo axis in motion: mj_step with forces that MuJoCo has no means for, compiled where numba is.

Like `laws`, this module imports nothing else of bayes_hw: a corrected simulator that is handed back carries
its text. A door has the position P q - o and the speed J v of the model, and a force there enters as J' f.
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bayes_hw.simulators.laws import COMPILED, LAW_NUMBERS, compiled, law_force


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


@compiled
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
