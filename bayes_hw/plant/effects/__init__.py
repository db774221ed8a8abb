"""The faults of the plant, one file a place in the axis or a group of those without a name."""

from __future__ import annotations

from collections.abc import Mapping

from bayes_hw.plant.effects import (
    command,
    disturbance,
    drive,
    linear,
    off_catalogue,
    second_group,
    sensor,
    unseen,
)
from bayes_hw.plant.effects.effect import Effect, Scales, faults_of

__all__ = ["CATALOGUE", "OFF_CATALOGUES", "Effect", "Scales"]

CATALOGUE = faults_of(command, linear, drive, disturbance, sensor)
"""One class for every label of the diagnosis' catalogue."""

OFF_CATALOGUES: Mapping[str, tuple[type[Effect], ...]] = {
    "known": faults_of(off_catalogue),
    "second": faults_of(second_group),
    "unseen": faults_of(unseen),
}
"""Faults that no entry of the diagnosis' catalogue describes, so that it is to say `other`: those it was made
on, more of them met late while it was made, and still more on which it was never changed, which measure how
it generalises."""
