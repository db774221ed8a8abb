"""From a simulator's file to its diagnosis: searched on its linear axis, answered on itself."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from bayes_hw.entrance import enter
from bayes_hw.errors import InputError
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.posing import Origin, Start, rested
from bayes_hw.record import Record
from bayes_hw.simulators.declaration import Declaration
from bayes_hw.simulators.edits import package
from bayes_hw.simulators.recentring import Recentring
from bayes_hw.simulators.simulator_file import SimulatorFile

MODELS = (".xml", ".mjcf", ".urdf")
CORRECTED = "corrected"
"""The folder of the corrected simulator within that of the results."""

KINDS = (*MODELS, ".fmu")


def is_simulator_file(name: str) -> bool:
    """Whether `--simulator` names a file rather than MODULE:FUNCTION."""
    return Path(name).suffix.lower() in KINDS


def open_simulator(path: Path, declaration: Path | None = None, jobs: int = 1) -> SimulatorFile:
    """The axis in a file, with the declaration beside it (PATH.toml) where none is given.

    Raises InputError on a missing file or extra, and on what does not fit the declaration.
    """
    if not path.is_file():
        raise InputError(f"{path}: is not there; give --simulator an MJCF, URDF or FMU file")
    beside = path.with_suffix(".toml")
    if declaration is None and not beside.is_file():
        raise InputError(f"{path}: needs a declaration; write {beside.name} beside it, or give --declaration")
    declared = Declaration.read(declaration or beside)
    if path.suffix.lower() == ".fmu":
        from bayes_hw.simulators.fmu_axis import FmuAxis

        return FmuAxis(path, declared)
    package()
    from bayes_hw.simulators.mjcf_axis import MjcfAxis

    return MjcfAxis(path, declared, jobs)


def simulator_case(
    axis: SimulatorFile,
    train: Sequence[Record],
    holdout: Sequence[Record],
    *,
    origin: Origin = "start",
    start: Start = "auto",
    accepted: Collection[str] = (),
) -> tuple[SimulatorCase, tuple[str, ...]]:
    """The records beside the axis' linear stand-in, and in words what was done to them.

    Angles count from where a record begins; one that begins in motion is cut to where it first rests, unless
    `start` is "rest". Raises InputError on records that do not fit.
    """
    own, cut = rested(train, start)
    held_out, held_out_cut = rested(holdout, start)
    notes = (*cut, *held_out_cut)
    SimulatorCase.of_records(axis.linear, own, held_out)
    found = enter(own, held_out, origin=origin, start="rest", accepted=accepted, looked_at=True)
    return SimulatorCase.of_records(axis.linear, found.records, found.holdout), (*notes, *found.notes)


def full_simulator(axis: SimulatorFile, jobs: int = 1) -> Recentring:
    """The simulator itself, behind its linear stand-in, as `bayes_hw.gap.diagnosis.diagnose` takes it."""
    return Recentring(axis, Each(jobs))
