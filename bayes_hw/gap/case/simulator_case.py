"""A case whose simulator is of any kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.entrance import check_repeats
from bayes_hw.errors import InputError
from bayes_hw.gap.case.case import ReadRecord, check_records
from bayes_hw.gap.case.simulator import Simulator, known_inputs
from bayes_hw.named_object import named_object
from bayes_hw.record import Record


@dataclass(frozen=True, eq=False)
class SimulatorCase:
    """A simulator and its records; outputs of `holdout` serve to score a finished prediction only.

    Every training record starts as the simulator starts. `history` holds, for every record held out, the
    inputs of the simulator that came before it: they are simulated and not scored, so that a record can be
    held out that does not start at rest. Empty where it does.
    """

    name: str
    model: Simulator
    train: tuple[Record, ...]
    holdout: tuple[Record, ...]
    history: tuple[FloatArray, ...]

    @classmethod
    def of_records(
        cls,
        simulator: Simulator,
        train: Sequence[Record],
        holdout: Sequence[Record],
        history: Sequence[FloatArray] = (),
    ) -> SimulatorCase:
        """A case of objects. Raises InputError on a rate not the simulator's, a record too short, one that
        stands in it twice, or one without a known input that the simulator takes."""
        check_records(simulator.name, simulator.sample_rate_hz, train, holdout)
        check_repeats(train, holdout)
        for record in (*train, *holdout):
            if lacking := [name for name in known_inputs(simulator) if name not in record.known]:
                raise InputError(
                    f"{record.name}: the simulator {simulator.name} takes {lacking[0]!r}, which was not "
                    f"read; give --known {lacking[0]!r}"
                )
        before = tuple(history) or tuple(inputs_of(simulator, record)[:0] for record in holdout)
        if len(before) != len(holdout):
            raise InputError(
                f"{simulator.name}: {len(before)} histories for {len(holdout)} records held out; give each "
                "one"
            )
        return cls(simulator.name, simulator, tuple(train), tuple(holdout), before)

    @classmethod
    def of_files(
        cls,
        simulator: Simulator,
        train: Sequence[Path],
        holdout: Sequence[Path],
        read_record: ReadRecord = Record.read,
    ) -> SimulatorCase:
        """Read the records of a simulator from files."""
        records = [read_record(path, units=simulator.units) for path in (*train, *holdout)]
        return cls.of_records(simulator, records[: len(train)], records[len(train) :])

    @property
    def inputs(self) -> list[FloatArray]:
        """What the simulator is given of every training record."""
        return [inputs_of(self.model, record) for record in self.train]

    @property
    def held_out_inputs(self) -> list[FloatArray]:
        """The same of every record held out, what came before it included."""
        given = [inputs_of(self.model, record) for record in self.holdout]
        return [np.concatenate(pair) for pair in zip(self.history, given, strict=True)]


def inputs_of(simulator: Simulator, record: Record) -> FloatArray:
    """The command (samples,) of a record, with the known inputs of the simulator (samples, columns)."""
    known = [record.known[name] for name in known_inputs(simulator)]
    return np.column_stack([record.u, *known]) if known else record.u


def find_simulator(name: str) -> Simulator:
    """What MODULE:FUNCTION returns without arguments; raises InputError where that is no simulator."""
    make = named_object(name, "--simulator")
    try:
        found = make() if callable(make) else make
    except Exception as error:
        raise InputError(
            f"--simulator {name}: fails ({type(error).__name__}: {error}); give a function that returns the "
            "simulator without arguments"
        ) from error
    needed = ("name", "parameters", "sample_rate_hz", "units", "noise_sigma", "force_door", "simulate")
    if missing := [part for part in needed if not hasattr(found, part)]:
        raise InputError(
            f"--simulator {name}: returned no simulator ({missing[0]} is missing); return a "
            "FunctionSimulator or what has its parts"
        )
    return found
