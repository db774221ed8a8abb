"""Whether a model and records were sampled alike."""

from __future__ import annotations

from collections.abc import Sequence

from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

RATE_TOLERANCE = 0.01


def check_rates(model: HammersteinWiener, records: Sequence[Record]) -> None:
    """Raise InputError unless every record has the model's sample rate (1 %)."""
    for record in records:
        if abs(record.sample_rate_hz / model.sample_rate_hz - 1) > RATE_TOLERANCE:
            raise InputError(
                f"{record.source or record.name}: sampled at {record.sample_rate_hz:g} Hz but the model is"
                f" for {model.sample_rate_hz:g} Hz; resample with --resample {model.sample_rate_hz:g}"
            )
