"""The corrected axis: python simulate.py RECORD.csv OUT.csv [DRAW]

Simulates the command u of a record (columns t,u, more are ignored) with the posterior mean, or with draw DRAW
(1 and up), and writes t,u,y. Needs numpy and fmpy; numba is used where it is. From Python:
simulate(u, draw=0). It stands alone: nothing of bayes_hw is imported.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.gap.simulate.signal_kernel import command_side, output_side
from bayes_hw.simulators.around import NEUTRAL, NUMBER
from bayes_hw.simulators.unit_loop import Unit


def simulate(u: Any, draw: int = 0, folder: Path | None = None) -> Any:
    """y (samples,) for commands u (samples,) at the rate of the records; draw 0 is the posterior mean."""
    place = Path(__file__).resolve().parent if folder is None else folder
    numbers = json.loads((place / "corrected.json").read_text())
    one, loop = numbers["draws"][draw - 1] if draw else numbers["mean"], numbers["loop"]
    settings = NEUTRAL.copy()
    for name, value in one["around"].items():
        settings[NUMBER[name]] = value
    given = np.ascontiguousarray(u, np.float64)
    command, w, y = np.empty(len(given)), np.empty(len(given)), np.empty(len(given))
    command_side(given, numbers["sample_rate_hz"], settings, command)
    unit = Unit(place / loop["unit"])
    try:
        found = unit.run(
            one["base"],
            dict.fromkeys(loop["commands"], command * loop["input_factor"]),
            [loop["output"]],
            loop["substeps"],
            loop["step_s"],
            [tuple(door) for door in loop["doors"]],
            np.array(one["laws"], np.float64),
        )[:, 0]
    finally:
        unit.close()
    output_side((found - found[0]) * loop["output_factor"], numbers["sample_rate_hz"], settings, w, y)
    return y


def main(arguments: list[str]) -> None:
    """Simulate the record in the first file, write to the second."""
    with Path(arguments[0]).open(newline="") as source:
        rows = list(csv.DictReader(source))
    commands = [float(row["u"]) for row in rows]
    shown = simulate(commands, int(arguments[2]) if len(arguments) > 2 else 0).tolist()
    with Path(arguments[1]).open("w") as target:
        target.write("t,u,y\n")
        target.writelines(f"{row['t']},{row['u']},{y!r}\n" for row, y in zip(rows, shown, strict=True))


if __name__ == "__main__":
    main(sys.argv[1:])
