"""The state of a sampler on disk, block by block, so that an interrupted run goes on where it was.

A checkpoint is a folder: `plan.h5` (the proposal that the pilot arrived at, and the ensembles as they stood
before the first block) and `block_00001.h5`, ... (one block of the chain and the ensembles after it). Every
file is written under a temporary name and renamed, and carries the fingerprint of the run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.hdf5_output import hdf5_written_atomically
from bayes_hw.formats.hdf5_probe import is_sound_hdf5
from bayes_hw.infer.ensemble import EnsembleState
from bayes_hw.infer.mixture import StudentTMixture
from bayes_hw.infer.triangular_map import Bend

MEANING = "poles under their names at the estimate, weights about least squares"
"""Coordinates that states and plans are kept in."""

REMEDY = "remove the folder and run without --resume"


@dataclass(frozen=True, eq=False)
class Plan:
    """What the pilot decided: the proposal density, the share of independence proposals, the mean acceptance
    that the pilot promised for them, and which of the coordinates proposals and walkers are in."""

    proposal: StudentTMixture
    independence_weight: float
    expected_acceptance: float
    choice: int = 0


@dataclass(frozen=True, eq=False)
class Block:
    """One block of steps: chain (ensembles, steps, walkers, parameters) in the parameters' coordinates, its
    log-probability without the last axis, accepted fraction (ensembles,), non-finite evaluations."""

    chain: FloatArray
    log_probability: FloatArray
    acceptance: FloatArray
    non_finite: int


class Checkpoint:
    """Reads and writes the checkpoint of one run in `folder`."""

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.folder = folder
        self.fingerprint = fingerprint

    def clear(self) -> None:
        """Remove the checkpoint's files, if there are any; other files in the folder stay."""
        for path in (*self.folder.glob("block_*.h5"), self.folder / "plan.h5"):
            path.unlink(missing_ok=True)

    def save_plan(self, plan: Plan, states: Sequence[EnsembleState]) -> None:
        with hdf5_written_atomically(self.folder / "plan.h5") as file:
            file.attrs["fingerprint"] = self.fingerprint
            file.attrs["independence_weight"] = plan.independence_weight
            file.attrs["expected_acceptance"] = plan.expected_acceptance
            file.attrs["choice"] = plan.choice
            file["weights"] = plan.proposal.weights
            file["means"] = plan.proposal.means
            file["factors"] = plan.proposal.factors
            file.attrs["degrees_of_freedom"] = plan.proposal.degrees_of_freedom
            if (bend := plan.proposal.bend) is not None:
                for name, array in vars(bend).items():
                    file[f"bend/{name}"] = array
            _write_states(file, states)

    def save_block(self, number: int, block: Block, states: Sequence[EnsembleState]) -> None:
        with hdf5_written_atomically(self._block_path(number)) as file:
            file.attrs["fingerprint"] = self.fingerprint
            file.attrs["non_finite"] = block.non_finite
            file["chain"] = block.chain
            file["log_probability"] = block.log_probability
            file["acceptance"] = block.acceptance
            _write_states(file, states)

    def load(self) -> tuple[Plan, list[Block], list[EnsembleState]] | None:
        """The plan, the finished blocks and the ensembles after them; None where no plan was saved.

        Raises InputError when a file is damaged or belongs to another run.
        """
        planned = self.folder / "plan.h5"
        if not planned.exists():
            return None
        files = [planned, *sorted(path for path in self.folder.glob("*.h5") if path != planned)]
        if not is_sound_hdf5(*files):
            damaged = next((path for path in files if not is_sound_hdf5(path)), self.folder)
            raise InputError(f"{damaged}: the checkpoint is damaged; {REMEDY}")
        with self._open(planned) as file:
            bent = {name: array[:] for name, array in file["bend"].items()} if "bend" in file else None
            proposal = StudentTMixture(
                file["weights"][:],
                file["means"][:],
                file["factors"][:],
                float(file.attrs["degrees_of_freedom"]),
                None if bent is None else Bend(**bent),
            )
            plan = Plan(
                proposal,
                float(file.attrs["independence_weight"]),
                float(file.attrs["expected_acceptance"]),
                int(file.attrs["choice"]),
            )
            states = _read_states(file)
        blocks: list[Block] = []
        while (path := self._block_path(len(blocks) + 1)).exists():
            with self._open(path) as file:
                blocks.append(
                    Block(
                        file["chain"][:],
                        file["log_probability"][:],
                        file["acceptance"][:],
                        int(file.attrs["non_finite"]),
                    )
                )
                states = _read_states(file)
        return plan, blocks, states

    def _block_path(self, number: int) -> Path:
        return self.folder / f"block_{number:05d}.h5"

    @contextmanager
    def _open(self, path: Path) -> Iterator[h5py.File]:
        try:
            with h5py.File(path, "r") as file:
                if file.attrs.get("fingerprint") != self.fingerprint:
                    raise InputError(
                        f"{path}: the checkpoint belongs to another run (other model, records, options or"
                        f" seed); {REMEDY}"
                    )
                yield file
        except InputError:
            raise
        except (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError):
            raise InputError(f"{path}: the checkpoint is damaged; {REMEDY}") from None


def fingerprint(*parts: str) -> str:
    """One digest of everything that decides the numbers of a run, the meaning of what is kept included."""
    return hashlib.sha256("\x1f".join((MEANING, *parts)).encode("utf-8")).hexdigest()


def _write_states(file: h5py.File, states: Sequence[EnsembleState]) -> None:
    for number, state in enumerate(states):
        group = file.create_group(f"ensemble_{number}")
        group["coordinates"] = state.coordinates
        group["log_probability"] = state.log_probability
        name, keys, position, has_gauss, cached = state.random_state
        group["random_keys"] = keys
        group.attrs["random_name"] = name
        group.attrs["random_position"] = position
        group.attrs["random_has_gauss"] = has_gauss
        group.attrs["random_cached"] = cached


def _read_states(file: h5py.File) -> list[EnsembleState]:
    states = []
    for number in range(sum(1 for name in file if name.startswith("ensemble_"))):
        group = file[f"ensemble_{number}"]
        states.append(
            EnsembleState(
                group["coordinates"][:],
                group["log_probability"][:],
                (
                    str(group.attrs["random_name"]),
                    np.asarray(group["random_keys"][:], dtype=np.uint32),
                    int(group.attrs["random_position"]),
                    int(group.attrs["random_has_gauss"]),
                    float(group.attrs["random_cached"]),
                ),
            )
        )
    return states
