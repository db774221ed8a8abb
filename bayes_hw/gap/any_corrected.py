"""The axis of a corrected.json, whichever diagnosis wrote it, for the commands that design with it."""

from __future__ import annotations

from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.gap.answer.axis_with_effects import AxisWithEffects
from bayes_hw.gap.answer.corrected_train import KEY
from bayes_hw.gap.answer.train_axis import TrainAxis
from bayes_hw.gap.joint.answer.corrected_axis import CORRECTED, SAMPLED, CorrectedAxis
from bayes_hw.gap.joint.answer.corrected_model import read_corrected


def read_corrected_axis(folder: Path | str) -> AxisWithEffects | None:
    """Of a folder that `diagnose` or `report` wrote; None where it holds a sampled posterior or neither.

    Raises InputError where corrected.json is damaged.
    """
    path = Path(folder) / CORRECTED
    if (Path(folder) / SAMPLED).is_file() or not path.is_file():
        return None
    data = read_corrected(path)
    if data is None:
        raise InputError(f"{path}: damaged or not written by bayes-hw; diagnose again")
    return TrainAxis.of(data) if KEY in data else CorrectedAxis.of(data)
