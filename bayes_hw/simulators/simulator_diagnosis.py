"""From a simulator's file to its diagnosis: the file opened, searched on its linear axis, answered on itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.diagnosis import Diagnosis, diagnose
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.simulators.declaration import Declaration
from bayes_hw.simulators.edits import package
from bayes_hw.simulators.recentring import Recentring

if TYPE_CHECKING:
    from bayes_hw.simulators.mjcf_axis import MjcfAxis

MODELS = (".xml", ".mjcf", ".urdf")
KINDS = (*MODELS, ".fmu")


def is_simulator_file(name: str) -> bool:
    """Whether `--simulator` names a file rather than MODULE:FUNCTION."""
    return Path(name).suffix.lower() in KINDS


def open_simulator(path: Path, declaration: Path | None = None, jobs: int = 1) -> MjcfAxis:
    """The axis in a file, with the declaration beside it (PATH.toml) where none is given.

    Raises InputError on a missing file or extra, and on what does not fit the declaration.
    """
    if not path.is_file():
        raise InputError(f"{path}: is not there; give --simulator an MJCF, URDF or FMU file")
    beside = path.with_suffix(".toml")
    if declaration is None and not beside.is_file():
        raise InputError(f"{path}: needs a declaration; write {beside.name} beside it, or give --declaration")
    declared = Declaration.read(declaration or beside)
    package()
    from bayes_hw.simulators.mjcf_axis import MjcfAxis

    return MjcfAxis(path, declared, jobs)


def simulator_case(
    axis: MjcfAxis, train: Sequence[Record], holdout: Sequence[Record]
) -> SimulatorCase:
    """The records beside the axis' linear stand-in, angles counted from where each record begins."""
    return SimulatorCase.of_records(axis.linear, train, holdout)


def diagnose_simulator(
    axis: MjcfAxis,
    case: SimulatorCase,
    rng: np.random.Generator,
    *,
    jobs: int = 1,
    without: frozenset[str] = frozenset(),
    progress: Progress | None = None,
) -> Diagnosis:
    """What the simulator lacks on the records of `case`, answered and measured on the simulator itself."""
    full = Recentring(axis, Each(jobs))
    return diagnose(case, rng, jobs=jobs, without=without, progress=progress, full=full)
