"""The corrected axis: python simulate.py RECORD.csv OUT.csv [DRAW]

Simulates the command u of a record (columns t,u, more are ignored) with the posterior mean, or with draw DRAW
(1 and up), and writes t,u,y. Needs numpy and mujoco; with numba it is much faster. From Python:
simulate(u, draw=0). It stands alone: nothing of bayes_hw is imported.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bayes_hw.simulators.axis_loop import run
from bayes_hw.simulators.corrected_run import numbers_of, simulate_around, simulate_file


def simulate(u: Any, draw: int = 0, folder: Path | None = None) -> Any:
    """y (samples,) for commands u (samples,), with known inputs (samples, columns), at the records' rate;
    draw 0 is the posterior mean."""
    place = Path(__file__).resolve().parent if folder is None else folder
    numbers, one, settings = numbers_of(place, draw)
    loop = numbers["loop"]
    model = mujoco.MjModel.from_xml_path(str(place / one["model"]))
    rests = np.array(loop["rests"], np.float64)

    def motion(command: Any, known: Any) -> Any:
        return run(
            model,
            command,
            loop["substeps"],
            loop["actuators"],
            loop["loop"],
            loop["loop_speed"],
            loop["loop_torque"],
            (
                np.array(loop["positions"], np.float64).reshape(len(rests), model.nq),
                np.array(loop["speeds"], np.float64).reshape(len(rests), model.nv),
                rests,
            ),
            np.array(one["laws"], np.float64),
            loop["read"],
            known,
        )

    return simulate_around(u, numbers, settings, motion)


if __name__ == "__main__":
    simulate_file(sys.argv[1:], simulate)
