"""The corrected MuJoCo axis, handed back: model files with the effect in them, a program that runs them.

A model file holds numbers to six digits, as MuJoCo writes them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.files import write_text_atomically
from bayes_hw.gap.case.simulator_case import inputs_of
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.simulators import axis_loop, laws, run_mjcf
from bayes_hw.simulators.around import named_settings
from bayes_hw.simulators.corrected import PROGRAM, corrected_ones, program, write_numbers
from bayes_hw.simulators.edits import set_in_description
from bayes_hw.simulators.mjcf_axis import MjcfAxis


def write_corrected(axis: MjcfAxis, diagnosis: Diagnosis, folder: Path, rng: np.random.Generator) -> None:
    """Write the posterior mean and the draws to `folder`, run them on the records held out as the program
    does, and say how far they close the gap there beside what the verdict said."""
    folder.mkdir(parents=True, exist_ok=True)
    items: list[dict[str, object]] = []
    for one in corrected_ones(diagnosis, rng):
        forces = axis.forces_of(one.base, one.settings)
        description = axis.description.copy()
        _point_to_assets(description, axis.path)
        set_in_description(description, axis.model, [*axis.base_edits(one.base), *forces.edits])
        file = f"draw_{one.number:02d}.xml" if one.number else "axis.xml"
        write_text_atomically(folder / file, description.to_xml())
        around = named_settings(one.settings)
        items.append(
            {"model": file, "parameters": one.parameters, "around": around, "laws": forces.laws.tolist()}
        )
    write_text_atomically(folder / PROGRAM, program(run_mjcf, (laws, axis_loop)))
    write_numbers(folder, axis, diagnosis, items, _loop(axis))
    outputs = [
        [run_mjcf.simulate(inputs_of(axis, record), number, folder) for record in diagnosis.case.holdout]
        for number in range(len(items))
    ]
    write_numbers(folder, axis, diagnosis, items, _loop(axis), outputs)


def _point_to_assets(description: Any, path: Path) -> None:
    """Folders of meshes and textures as they are from anywhere."""
    folder = path.resolve().parent
    for name in ("meshdir", "texturedir"):
        given = getattr(description, name)
        if description.meshes or description.textures:
            setattr(description, name, str(folder / given))


def _loop(axis: MjcfAxis) -> dict[str, object]:
    """What the program needs beside the model."""
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
        "known": axis.entering(list(axis.places)),
        "count": len(places),
        "positions": [place.position.tolist() for place in places],
        "speeds": [place.speed.tolist() for place in places],
        "rests": [place.rest for place in places],
    }
