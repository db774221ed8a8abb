"""Shares add up to one and leave the reference out; a bias beyond half the interval is called so."""

from __future__ import annotations

import pytest
from pages.error_sources_report import (
    REFERENCE,
    ErrorSource,
    ParameterError,
    bias_shares,
    width_shares,
)

LIMIT, MODE = "saturation.lower", "mode1.frequency_hz"


def source(name: str, family: str, **errors: tuple[float, float]) -> ErrorSource:
    names = {"limit": LIMIT, "mode": MODE}
    parameters = {names[k]: ParameterError(1.0, bias, half, 0, "") for k, (bias, half) in errors.items()}
    return ErrorSource(name, family, "", 1, 1, 1, parameters)


SOURCES = (
    source("base", REFERENCE, limit=(0.5, 3.0), mode=(0.0, 1.0)),
    source("noise", "noise", limit=(-1.0, 5.0), mode=(0.0, 1.0)),
    source("play", "structure", limit=(3.0, 2.0)),
)


def test_width_shares_count_only_what_is_added_to_the_reference() -> None:
    assert width_shares(SOURCES, LIMIT) == {"noise": 1.0, "play": 0.0}
    assert width_shares(SOURCES, MODE) == {"noise": 0.0}


def test_bias_shares_are_of_sizes() -> None:
    assert bias_shares(SOURCES, LIMIT) == pytest.approx({"noise": 0.25, "play": 0.75})


def test_an_interval_lies_where_the_bias_exceeds_half_of_it() -> None:
    assert SOURCES[1].lying == ()
    assert SOURCES[2].lying == (LIMIT,)
