"""What the records behind a corrected model asked of the axis, and where it went."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.infer.posterior import extremes
from bayes_hw.record import Record


def motion_of(records: Sequence[Record]) -> dict[str, object]:
    """The `motion` of a corrected.json: largest command and its rate of change, smallest and largest command,
    and the stroke, in the records' units."""
    return {
        "velocity": max(float(np.abs(r.u).max()) for r in records),
        "acceleration": max(float(np.abs(np.diff(r.u)).max()) * r.sample_rate_hz for r in records),
        "commanded": list(extremes(r.u for r in records)),
        "stroke": [min(float(r.y.min()) for r in records), max(float(r.y.max()) for r in records)],
    }
