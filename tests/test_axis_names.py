"""An axis is called by what its records have in common, never by a word that any log has."""

from __future__ import annotations

import pytest

from bayes_hw.commands.records import axis_name


@pytest.mark.parametrize(
    ("records", "name"),
    [
        (["logs/A_el_sweep.csv", "logs/A_el_triangles.csv"], "A_el"),
        (["logs/az-night-1.csv", "logs/az-night-2.csv"], "az"),
        (["azimuth/train_1.csv", "azimuth/train_2.csv"], "azimuth"),
        (["logs/train_1.csv", "logs/train_2.csv"], "train_1"),
        (["data/20261113_az.csv"], "20261113_az"),
        (["run 12.csv", "other/run 13.csv"], "run 12"),
    ],
)
def test_name(records: list[str], name: str) -> None:
    assert axis_name(records) == name
