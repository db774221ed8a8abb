"""What the programs of corrected simulators share: numbers of a draw, signals around the simulator, files.

Part of those programs, so nothing of bayes_hw is needed but what `corrected.program` writes into them.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.gap.simulate.signal_kernel import command_side, output_side
from bayes_hw.simulators.around import NEUTRAL, NUMBER


def numbers_of(place: Path, draw: int) -> tuple[Any, Any, Any]:
    """All that corrected.json in `place` holds, what it holds of a draw (0 is the posterior mean), and the
    settings (COUNT,) of what is before and behind the simulator there."""
    numbers = json.loads((place / "corrected.json").read_text())
    one = numbers["draws"][draw - 1] if draw else numbers["mean"]
    settings = NEUTRAL.copy()
    for name, value in one["around"].items():
        settings[NUMBER[name]] = value
    return numbers, one, settings


def simulate_around(u: Any, numbers: Any, settings: Any, motion: Callable[[Any, Any], Any]) -> Any:
    """y (samples,) for commands u (samples,), with known inputs (samples, columns), in the record's units.

    `motion` is the simulator's output (samples,) for its command (samples,) and the forces (samples, doors)
    that are known at its doors, in its own.
    """
    rate, loop = numbers["sample_rate_hz"], numbers["loop"]
    given = np.asarray(u, np.float64).reshape(len(u), -1)
    command, w, y = np.empty(len(given)), np.empty(len(given)), np.empty(len(given))
    forces = np.zeros((len(given), loop["count"]))
    for column, (_, door, factor) in enumerate(loop["known"], start=1):
        forces[:, door] += factor * given[:, column]
    command_side(np.ascontiguousarray(given[:, 0]), rate, settings, command)
    found = motion(command * loop["input_factor"], forces)
    output_side((found - found[0]) * loop["output_factor"], rate, settings, w, y)
    return y


def simulate_file(arguments: list[str], simulate: Callable[[Any, int], Any]) -> None:
    """Simulate the record in the first file, with the draw that the third argument says, write to the
    second."""
    with Path(arguments[0]).open(newline="") as source:
        rows = list(csv.DictReader(source))
    known = json.loads((Path(__file__).resolve().parent / "corrected.json").read_text())["loop"]["known"]
    inputs = [[float(row[name]) for name in ("u", *(one[0] for one in known))] for row in rows]
    shown = simulate(inputs, int(arguments[2]) if len(arguments) > 2 else 0).tolist()
    with Path(arguments[1]).open("w") as target:
        target.write("t,u,y\n")
        target.writelines(f"{row['t']},{row['u']},{y!r}\n" for row, y in zip(rows, shown, strict=True))
