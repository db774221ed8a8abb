"""Stamps as text: plain ISO 8601 is read without a library, to the nanosecond."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.log.clock import StampError, read_stamps

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@settings(deadline=None)
@given(
    dates=st.lists(st.datetimes(datetime(1901, 1, 1), datetime(2099, 1, 1)), min_size=1, max_size=5),
    between=st.sampled_from("T "),
    zone=st.sampled_from(["", "Z", "+00:00"]),
)
def test_iso_stamps_are_their_differences(dates: list[datetime], between: str, zone: str) -> None:
    """The two plain spellings without a library, the third with one."""
    found = read_stamps(np.array([f"{one.isoformat(sep=between)}{zone}" for one in dates]))
    assert found.origin_ns is not None
    microseconds = [(one.replace(tzinfo=UTC) - EPOCH) for one in dates]
    whole = [((d.days * 86_400) + d.seconds) * 10**9 + d.microseconds * 1000 for d in microseconds]
    assert found.origin_ns == whole[0]
    np.testing.assert_array_equal(found.seconds, (np.array(whole) - whole[0]) / 1e9)


def test_a_day_that_there_is_not_is_named() -> None:
    with pytest.raises(StampError, match="2026-02-30"):
        read_stamps(np.array(["2026-02-28T10:00:00", "2026-02-30T10:00:01"]))


def test_a_stamp_beyond_all_numbers_is_named() -> None:
    with pytest.raises(StampError, match="'1e999' is no number"):
        read_stamps(np.array(["0.1", "1e999", "0.3"]))
