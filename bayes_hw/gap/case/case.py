"""A case: a simulator, records to train on, records held out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from bayes_hw.arrays import FloatArray
from bayes_hw.entrance import check_scale, enter
from bayes_hw.errors import InputError
from bayes_hw.gap.case.case_file import read_case_file
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Origin, Start, rested
from bayes_hw.record import Record, Units

RATE_TOLERANCE = 1e-6

SHORTEST = 200
"""Samples that a record must have."""

APART = 1e-3
"""Beginnings farther apart, in travels, are different places of the axis."""


class ReadRecord(Protocol):
    """Reads one record of a model in these units, as `Record.read` does."""

    def __call__(self, path: Path, *, units: Units) -> Record: ...


@dataclass(frozen=True, eq=False)
class Case:
    """The nominal model and its records; outputs of `holdout` serve to score a finished prediction only."""

    name: str
    model: HammersteinWiener
    train: tuple[Record, ...]
    holdout: tuple[Record, ...]

    @classmethod
    def read(cls, folder: Path, read_record: ReadRecord = Record.read) -> Case:
        """Read case.json and what it names, relative to `folder`. Raises InputError on anything wrong."""
        named = read_case_file(folder)
        return cls.of_files(folder.resolve().name, named.model, named.train, named.holdout, read_record)

    @classmethod
    def of_files(
        cls,
        name: str,
        model: Path,
        train: Sequence[Path],
        holdout: Sequence[Path],
        read_record: ReadRecord = Record.read,
    ) -> Case:
        """Read a model and records from files."""
        nominal = HammersteinWiener.read(model)
        records = [read_record(path, units=nominal.units) for path in (*train, *holdout)]
        return cls.of_records(name, nominal, records[: len(train)], records[len(train) :])

    @classmethod
    def of_records(
        cls, name: str, model: HammersteinWiener, train: Sequence[Record], holdout: Sequence[Record]
    ) -> Case:
        """A case of objects. Raises InputError on a rate that is not the model's or a record too short."""
        check_records(name, model.sample_rate_hz, train, holdout)
        return cls(name, model, tuple(train), tuple(holdout))

    def posed(
        self,
        *,
        origin: Origin = "start",
        start: Start = "auto",
        accepted: Collection[str] = (),
        looked_at: bool = False,
    ) -> tuple[Case, tuple[str, ...]]:
        """The case with its records as `bayes_hw.entrance.enter` poses them, and in words what was done.

        A record that begins in motion is cut to where it first rests, unless `start` is "rest". Raises
        InputError on mistakes, and where too little of a record is left. `accepted` and `looked_at` as there.
        """
        train, cut = rested(self.train, start)
        holdout, held_out_cut = rested(self.holdout, start)
        notes = [*cut, *held_out_cut]
        for record in (*train, *holdout):
            if start != "rest" and len(record) < SHORTEST:
                raise InputError(
                    f"{record.name}: {len(record)} samples from rest on; give {SHORTEST} or more"
                )
        found = enter(
            train,
            holdout,
            model=self.model,
            origin=origin,
            start="rest",
            accepted=accepted,
            looked_at=looked_at,
        )
        origins = [record.origin for record in (*found.records, *found.holdout)]
        travel = max(float(abs(record.y).max()) for record in found.records)
        if max(origins) - min(origins) > APART * travel:
            notes.append(
                f"records begin at {min(origins):.6g} to {max(origins):.6g} {self.model.units.output}: "
                "effects of the axis's position are looked for in the angle from each record's beginning; "
                "records that begin at one angle show them best"
            )
        return replace(self, train=found.records, holdout=found.holdout), (*found.notes, *notes)

    @property
    def inputs(self) -> list[FloatArray]:
        """Commands of every training record."""
        return [record.u for record in self.train]

    @property
    def held_out_inputs(self) -> list[FloatArray]:
        """Commands of every record held out."""
        return [record.u for record in self.holdout]


def check_records(name: str, rate: float, train: Sequence[Record], holdout: Sequence[Record]) -> None:
    """Raise InputError where there is none to train on or held out, one at another rate, or one too short."""
    if not train:
        raise InputError(
            f'{name}: no record to train on; give at least one (--train, or "train" in case.json)'
        )
    if not holdout:
        raise InputError(
            f'{name}: no record held out; give one (--holdout, or "holdout" in case.json), or split a record'
        )
    for record in (*train, *holdout):
        if abs(record.sample_rate_hz / rate - 1) > RATE_TOLERANCE:
            check_scale(record)
            raise InputError(
                f"{record.name}: sampled at {record.sample_rate_hz:g} Hz, the model at {rate:g} Hz; "
                "resample one of them"
            )
        if len(record.u) < SHORTEST:
            raise InputError(f"{record.name}: {len(record.u)} samples; give {SHORTEST} or more")
