"""The constants by which nats become probabilities around a given model."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files
from typing import Self

from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration

FILE = "given_calibration.json"


@dataclass(frozen=True)
class GivenCalibration(JointCalibration):
    """Those of `given_calibration.json`, which states beside every value the standard deviation of its
    logarithm: how well the cases that it was fitted to tell it.

    G as given cannot take up an effect, so they are not those of records alone. `excess_doubt` is the doubt
    of `other` where more is left than the noise that the model states.
    """

    excess_doubt: float

    @classmethod
    def built_in(cls) -> Self:
        """The constants that come with the program."""
        text = files("bayes_hw.gap.joint.decision").joinpath(FILE).read_text(encoding="utf-8")
        return cls(**{name: content["value"] for name, content in json.loads(text).items()})
