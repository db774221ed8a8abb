"""Whether records, and a model and records, were sampled alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.entrance import RATE_TOLERANCE
from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def check_rates(model: HammersteinWiener, records: Sequence[Record]) -> None:
    """Raise InputError unless every record has the model's sample rate (1 %)."""
    for record in records:
        if abs(record.sample_rate_hz / model.sample_rate_hz - 1) > RATE_TOLERANCE:
            raise InputError(
                f"{record.source or record.name}: sampled at {record.sample_rate_hz:g} Hz but the model is"
                f" for {model.sample_rate_hz:g} Hz; resample with --resample {model.sample_rate_hz:g}"
            )


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
