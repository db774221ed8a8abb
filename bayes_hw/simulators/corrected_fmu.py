"""The corrected FMU, handed back: the one that was given within a wrapper that is an FMU, and a program."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np

from bayes_hw.files import temporary_sibling, write_text_atomically
from bayes_hw.gap.case.simulator_case import inputs_of
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.simulators import laws, run_fmu, unit_loop
from bayes_hw.simulators.around import named_settings
from bayes_hw.simulators.corrected import NUMBERS, PROGRAM, corrected_ones, program, write_numbers
from bayes_hw.simulators.fmu_axis import FmuAxis

INNER = "given.fmu"
WRAPPER = "corrected_axis.fmu"


def write_corrected(axis: FmuAxis, diagnosis: Diagnosis, folder: Path, rng: np.random.Generator) -> None:
    """Write the FMU that was given, what it takes, and the program that runs both to `folder`, run them on
    the records held out, and wrap them in an FMU where pythonfmu is installed."""
    folder.mkdir(parents=True, exist_ok=True)
    with temporary_sibling(folder / INNER) as copied:
        shutil.copyfile(axis.path, copied)
    items: list[dict[str, object]] = [
        {
            "parameters": one.parameters,
            "base": axis.named(one.base),
            "around": named_settings(one.settings),
            "laws": axis.laws_of(one.base, one.settings).tolist(),
        }
        for one in corrected_ones(diagnosis, rng)
    ]
    write_text_atomically(folder / PROGRAM, program(run_fmu, (laws, unit_loop)))
    write_numbers(folder, axis, diagnosis, items, _loop(axis))
    outputs = [
        [run_fmu.simulate(inputs_of(axis, record), number, folder) for record in diagnosis.case.holdout]
        for number in range(len(items))
    ]
    write_numbers(folder, axis, diagnosis, items, _loop(axis), outputs)
    write_wrapper(folder)


def write_wrapper(folder: Path) -> bool:
    """Wrap what is in `folder` in an FMU there; whether pythonfmu is installed to do so."""
    try:
        from pythonfmu.builder import FmuBuilder

        from bayes_hw.simulators import wrapper_unit
    except ImportError:
        return False
    with tempfile.TemporaryDirectory(prefix="bayes-hw-") as name:
        place = Path(name)
        script = place / "corrected_axis.py"
        script.write_text(program(wrapper_unit, (laws, unit_loop)))
        made = FmuBuilder.build_FMU(script, place, [folder / INNER, folder / NUMBERS])
        with temporary_sibling(folder / WRAPPER) as wrapper:
            shutil.copyfile(made, wrapper)
    return True


def _loop(axis: FmuAxis) -> dict[str, object]:
    """What the program needs beside the FMU."""
    return {
        "unit": INNER,
        "input_factor": axis.declaration.input_factor,
        "output_factor": axis.declaration.output_factor,
        "commands": list(axis.declaration.actuators),
        "output": axis.output,
        "substeps": axis.substeps,
        "step_s": axis.step_s,
        "doors": [list(door) for door in axis.doors_of.values()],
        "known": axis.entering(list(axis.doors_of)),
        "count": len(axis.doors_of),
    }
