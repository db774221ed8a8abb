"""The axis of a corrected.json, whichever diagnosis wrote it, for the commands that design with it."""

from __future__ import annotations

from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.gap.answer.axis_with_effects import AxisWithEffects
from bayes_hw.gap.answer.corrected_train import KEY
from bayes_hw.gap.answer.train_axis import TrainAxis
from bayes_hw.gap.joint.answer.corrected_axis import CORRECTED, SAMPLED, CorrectedAxis
from bayes_hw.gap.joint.answer.corrected_model import read_corrected


def corrected_file(place: Path) -> Path | None:
    """The corrected.json that `place` is, or that it holds as a folder without a sampled posterior."""
    if place.is_file():
        return place
    path = place / CORRECTED
    return path if path.is_file() and not (place / SAMPLED).is_file() else None


def read_corrected_axis(place: Path | str) -> AxisWithEffects | None:
    """Of a corrected.json, or of a folder that `diagnose` or `report` wrote; None where a folder holds a
    sampled posterior or neither.

    Raises InputError where corrected.json is damaged.
    """
    path = corrected_file(Path(place))
    if path is None:
        return None
    data = read_corrected(path)
    if data is None:
        raise InputError(f"{path}: damaged or not written by bayes-hw; diagnose again")
    return TrainAxis.of(data) if KEY in data else CorrectedAxis.of(data)
