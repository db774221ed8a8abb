"""A share of cases in words."""

from __future__ import annotations

from bayes_hw.gap.blind.counts import Share
from bayes_hw.report.page.rounding import format_percent

WIDE = 0.1
"""Interval of a share that is wider is given without decimals."""


def share_text(entry: Share) -> str:
    """hits of trials, per cent and interval, with as many digits as that has a meaning for."""
    if not entry.trials:
        return "no case"
    low, high = entry.interval
    digits = 0 if high - low > WIDE else 1
    return (
        f"{entry.hits} of {entry.trials}, {format_percent(entry.value, digits)}"
        f" [{100 * low:.{digits}f}, {100 * high:.{digits}f}]"
    )
