"""The corrected axis: python simulate.py RECORD.csv OUT.csv [DRAW]

Simulates the command u of a record (columns t,u, more are ignored) with the posterior mean, or with draw DRAW
(1 and up), and writes t,u,y. Needs numpy and fmpy; numba is used where it is. From Python:
simulate(u, draw=0). It stands alone: nothing of bayes_hw is imported.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.simulators.corrected_run import numbers_of, simulate_around, simulate_file
from bayes_hw.simulators.unit_loop import Unit


def simulate(u: Any, draw: int = 0, folder: Path | None = None) -> Any:
    """y (samples,) for commands u (samples,), with known inputs (samples, columns), at the records' rate;
    draw 0 is the posterior mean."""
    place = Path(__file__).resolve().parent if folder is None else folder
    numbers, one, settings = numbers_of(place, draw)
    loop = numbers["loop"]
    unit = Unit(place / loop["unit"])

    def motion(command: Any, known: Any) -> Any:
        return unit.run(
            one["base"],
            dict.fromkeys(loop["commands"], command),
            [loop["output"]],
            loop["substeps"],
            loop["step_s"],
            [tuple(door) for door in loop["doors"]],
            np.array(one["laws"], np.float64),
            known,
        )[:, 0]

    try:
        return simulate_around(u, numbers, settings, motion)
    finally:
        unit.close()


if __name__ == "__main__":
    simulate_file(sys.argv[1:], simulate)
