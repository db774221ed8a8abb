"""An axis to test on."""

from __future__ import annotations

import numpy as np

from bayes_hw.plant.drive_train import draw_drive_train
from bayes_hw.plant.run import Axis


def an_axis(seed: int, rate: float = 20.0) -> Axis:
    """A drive train drawn with this seed behind limits and before a dead zone."""
    rng = np.random.default_rng(seed)
    return Axis(draw_drive_train(rng, (20.0, 60.0)), -0.31, 0.42, 0.05, int(rng.integers(0, 4)), rate)
