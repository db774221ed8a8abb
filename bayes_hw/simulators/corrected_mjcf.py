"""The corrected MuJoCo axis, handed back: model files with the effect in them, a program that runs them.

The folder needs nothing of bayes_hw: `simulate.py` carries the text of `axis_loop` and of the kernels for
what is before and behind the simulator. A model file holds numbers to six digits, as MuJoCo writes them.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import write_text_atomically
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate import signal_kernel
from bayes_hw.record import Record
from bayes_hw.simulators import axis_loop, laws
from bayes_hw.simulators.edits import set_in_description
from bayes_hw.simulators.mjcf_axis import MjcfAxis

SCHEMA = "bayes-hw/corrected-simulator/1"
DRAWS = 20
NUMBERS = "corrected.json"
PROGRAM = "simulate.py"

SIDES = S.COMMAND_SIDE | S.OUTPUT_SIDE
NAMES = {value: name for name, value in vars(S).items() if name.isupper() and isinstance(value, int)}


@dataclass(frozen=True)
class Corrected:
    """One corrected simulator: parameters by name, settings (COUNT,) and values of the base parameters."""

    file: str
    parameters: dict[str, float]
    base: FloatArray
    settings: FloatArray


def corrected_ones(diagnosis: Diagnosis, rng: np.random.Generator) -> list[Corrected]:
    """The posterior mean, in the coordinates of the parameters, and DRAWS draws."""
    hypothesis = diagnosis.final.fit.hypothesis
    picked = rng.choice(len(diagnosis.draws), DRAWS, replace=len(diagnosis.draws) < DRAWS)
    points = np.vstack([diagnosis.draws.mean(axis=0), diagnosis.draws[picked]])
    found = []
    for number, values in enumerate(hypothesis.to_values(points)):
        named = dict(zip((p.name for p in hypothesis.parameters), values.tolist(), strict=True))
        settings = hypothesis.settings(values, hypothesis.chain(values))
        file = "axis.xml" if number == 0 else f"draw_{number:02d}.xml"
        found.append(Corrected(file, named, values[: hypothesis.base_count], settings))
    return found


def write_corrected(axis: MjcfAxis, diagnosis: Diagnosis, folder: Path, rng: np.random.Generator) -> None:
    """Write the posterior mean and the draws to `folder`, run them on the records held out, and say how far
    they close the gap there beside what the verdict said."""
    ones = corrected_ones(diagnosis, rng)
    folder.mkdir(parents=True, exist_ok=True)
    items, outputs = [], []
    for one in ones:
        forces = axis.forces_of(one.base, one.settings)
        description = axis.description.copy()
        _point_to_assets(description, axis.path)
        set_in_description(description, axis.model, [*axis.base_edits(one.base), *forces.edits])
        write_text_atomically(folder / one.file, description.to_xml())
        items.append(
            {
                "model": one.file,
                "parameters": one.parameters,
                "around": {
                    NAMES[i]: float(one.settings[i]) for i in sorted(SIDES) if one.settings[i] != S.NEUTRAL[i]
                },
                "laws": forces.laws.tolist(),
            }
        )
        outputs.append([_run(axis, folder, one, forces.laws, record) for record in diagnosis.case.holdout])
    closed = [_closure(diagnosis, output) for output in outputs]
    verdict = diagnosis.verdict
    numbers = {
        "schema": SCHEMA,
        "answer": list(verdict.answer),
        "not_in_it": [label for label in verdict.answer if label not in _acting(diagnosis)],
        "sample_rate_hz": axis.sample_rate_hz,
        "units": axis.units.to_dict(),
        "loop": _loop(axis),
        "mean": items[0],
        "draws": items[1:],
        "holdout": {
            "closed": closed[0],
            "closed_draws": closed[1:],
            "said": verdict.gap_holdout.to_dict(),
        },
    }
    write_text_atomically(folder / PROGRAM, program())
    write_text_atomically(folder / NUMBERS, json.dumps(numbers, indent=1) + "\n")


def _acting(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Labels of effects that act on the response; those of the noise are not in a simulator."""
    return diagnosis.final.fit.hypothesis.labels


def _point_to_assets(description: Any, path: Path) -> None:
    """Folders of meshes and textures as they are from anywhere."""
    folder = path.resolve().parent
    for name in ("meshdir", "texturedir"):
        given = getattr(description, name)
        if description.meshes or description.textures:
            setattr(description, name, str(folder / given))


def _run(axis: MjcfAxis, folder: Path, one: Corrected, laws: FloatArray, record: Record) -> FloatArray:
    """What the written model gives for a record's command, as `simulate.py` runs it."""
    model = axis.mujoco.MjModel.from_xml_path(str(folder / one.file))
    command, w, y = (np.empty(len(record.u)) for _ in range(3))
    u = np.ascontiguousarray(record.u, np.float64)
    signal_kernel.command_side(u, axis.sample_rate_hz, one.settings, command)
    output = axis.motion(model, command, laws)
    signal_kernel.output_side(output, axis.sample_rate_hz, one.settings, w, y)
    return y


def _closure(diagnosis: Diagnosis, outputs: Sequence[FloatArray]) -> float:
    """1 - reducible squared error after over before, on the records held out."""
    said = diagnosis.verdict.gap_holdout
    errors = np.concatenate([r.y - y for r, y in zip(diagnosis.case.holdout, outputs, strict=True)])
    before = said.rmse_before**2 - said.noise_floor**2
    after = float(np.mean(errors**2)) - said.noise_floor**2
    return 1 - after / before if before > 0 else 0.0


def _loop(axis: MjcfAxis) -> dict[str, object]:
    """What `simulate.py` needs beside the model."""
    places = list(axis.places.values())
    return {
        "input_factor": axis.declaration.input_factor,
        "output_factor": axis.declaration.output_factor,
        "substeps": axis.substeps,
        "actuators": axis.actuators,
        "loop": axis.loop_numbers,
        "loop_speed": axis.loop_speed.tolist(),
        "loop_torque": axis.loop_torque.tolist(),
        "read": list(axis.read),
        "positions": [place.position.tolist() for place in places],
        "speeds": [place.speed.tolist() for place in places],
        "rests": [place.rest for place in places],
    }


HEAD = '''"""The corrected axis: python simulate.py RECORD.csv OUT.csv [DRAW]

Simulates the command u of a record (columns t,u, more are ignored) with the posterior mean, or with draw
DRAW (1 to {draws}), and writes t,u,y. Needs numpy and mujoco; with numba it is a hundred times faster.
From Python: simulate(u, draw=0).

Written by bayes-hw; what follows is its own text.
"""
'''

TAIL = '''

def simulate(u, draw=0):
    """y (samples,) for commands u (samples,) at the rate of the records; draw 0 is the posterior mean."""
    folder = Path(__file__).resolve().parent
    numbers = json.loads((folder / "corrected.json").read_text())
    one, loop = numbers["draws"][draw - 1] if draw else numbers["mean"], numbers["loop"]
    settings = NEUTRAL.copy()
    for name, value in one["around"].items():
        settings[NUMBER[name]] = value
    u = np.ascontiguousarray(u, np.float64)
    command, w, y = np.empty(len(u)), np.empty(len(u)), np.empty(len(u))
    command_side(u, numbers["sample_rate_hz"], settings, command)
    model = mujoco.MjModel.from_xml_path(str(folder / one["model"]))
    doors = [np.array(loop[key], np.float64) for key in ("positions", "speeds", "rests")]
    doors[:2] = [each.reshape(len(doors[2]), size) for each, size in zip(doors, (model.nq, model.nv))]
    found = run(
        model, command * loop["input_factor"], loop["substeps"], loop["actuators"], loop["loop"],
        loop["loop_speed"], loop["loop_torque"], doors, np.array(one["laws"], np.float64), loop["read"],
    )
    output_side((found - found[0]) * loop["output_factor"], numbers["sample_rate_hz"], settings, w, y)
    return y


if __name__ == "__main__":
    with open(sys.argv[1], newline="") as source:
        rows = list(csv.DictReader(source))
    commands = [float(row["u"]) for row in rows]
    shown = simulate(commands, int(sys.argv[3]) if len(sys.argv) > 3 else 0)
    with open(sys.argv[2], "w") as target:
        target.write("t,u,y\\n")
        target.writelines(f"{row['t']},{row['u']},{y!r}\\n" for row, y in zip(rows, map(float, shown)))
'''


def program() -> str:
    """The text of `simulate.py`."""
    own = [_text(module) for module in (laws, axis_loop)]
    imports = "import csv\nimport json\nimport sys"
    kernels = "\n\n".join(_source(name) for name in ("behind_dead_zone", "command_side", "output_side"))
    constants = "\n".join(f"{NAMES[i]} = {i}" for i in sorted(SIDES))
    neutral = ", ".join(f'float("{x!r}")' if np.isinf(x) else repr(x) for x in S.NEUTRAL.tolist())
    numbers = ", ".join(f'"{NAMES[i]}": {i}' for i in sorted(SIDES))
    table = f"NEUTRAL = np.array([{neutral}])\nNUMBER = {{{numbers}}}"
    parts = [HEAD.format(draws=DRAWS), imports, *own, f"TAU = TURN\n{constants}\n{table}", kernels, TAIL]
    return "\n\n".join(parts)


def _text(module: ModuleType) -> str:
    """A module's text without its docstring and without what it imports of bayes_hw."""
    text = inspect.getsource(module)
    lines = text[text.index("from __future__") :].splitlines()[1:]
    return "\n".join(line for line in lines if not line.startswith("from bayes_hw")).strip()


def _source(name: str) -> str:
    """A compiled kernel's text, its settings under their bare names and nothing kept on disk."""
    text = inspect.getsource(getattr(signal_kernel, name).py_func)
    return re.sub(r"@njit\(.*\)", "@compiled", re.sub(r"\bS\.([A-Z_]+)", r"\1", text))


__all__ = ["Corrected", "corrected_ones", "program", "write_corrected"]
