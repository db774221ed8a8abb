"""Whether records, and a model and records, were sampled alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.entrance import SimulatedAxis, check_rate
from bayes_hw.errors import InputError
from bayes_hw.record import Record


def check_rates(model: SimulatedAxis, records: Sequence[Record]) -> None:
    """Raise InputError unless every record has the model's sample rate (1 %)."""
    for record in records:
        check_rate(record, model.sample_rate_hz, "the model")


def check_alike(records: Sequence[Record]) -> None:
    """Raise InputError unless there are records, all of one sample rate and in one set of units."""
    if not records:
        raise InputError("no record given; name at least one file")
    first = records[0]
    for record in records:
        if not np.isclose(record.sample_rate_hz, first.sample_rate_hz, rtol=1e-6):
            raise InputError(
                f"record {record.name}: {record.sample_rate_hz:g} Hz but {first.name} has "
                f"{first.sample_rate_hz:g} Hz; resample them to one rate"
            )
        if record.units != first.units:
            raise InputError(f"record {record.name}: units differ from those of {first.name}")
