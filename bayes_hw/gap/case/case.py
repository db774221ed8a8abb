"""A case: a simulator, records to train on, records held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from bayes_hw.arrays import FloatArray
from bayes_hw.entrance import check_scale
from bayes_hw.errors import InputError
from bayes_hw.gap.case.case_file import read_case_file
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units

RATE_TOLERANCE = 1e-6

SHORTEST = 200
"""Samples that a record must have."""


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
