"""The verdict of a diagnosis, as verdict.json holds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import write_json
from bayes_hw.format_names import VERDICT
from bayes_hw.gap.answer.judgement import NONE
from bayes_hw.gap.answer.locate import Location
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.fit.draws import PROBABILITY
from bayes_hw.model.priors import LogNormal

NOISE_SIGMA = "noise.sigma"
"""Name of the encoder's noise among the base parameters."""

QUANTILES = 40_000
"""That stand for a distribution: its moments and interval to half a per cent where it is widest."""


def highest_density_interval(draws: FloatArray, probability: float) -> tuple[float, float]:
    """The narrowest interval of `probability` of draws (n,): that of ArviZ, whose import takes a second."""
    ordered = np.sort(draws)
    inside = int(np.floor(probability * len(ordered)))
    first = int(np.argmin(ordered[inside:] - ordered[: len(ordered) - inside]))
    return float(ordered[first]), float(ordered[first + inside])


@dataclass(frozen=True)
class Estimate:
    """A parameter's posterior: mean, standard deviation, 94 % highest-density interval, unit."""

    mean: float
    sd: float
    hdi94: tuple[float, float]
    unit: str

    @classmethod
    def of(cls, draws: FloatArray, unit: str) -> Estimate:
        """Of draws (n,); where all are one number there is no spread, not that of rounding their mean."""
        mean, sd = (draws.mean(), draws.std()) if np.ptp(draws) > 0 else (draws[0], 0.0)
        return cls(float(mean), float(sd), highest_density_interval(draws, PROBABILITY), unit)

    @classmethod
    def log_normal(cls, median: float, relative_error: float, unit: str) -> Estimate:
        """Of a positive parameter whose logarithm is normal, of standard deviation `relative_error`."""
        probabilities = (np.arange(QUANTILES) + 0.5) / QUANTILES
        return cls.of(LogNormal(median, relative_error).quantile(probabilities), unit)

    def to_dict(self) -> dict[str, object]:
        return {"mean": self.mean, "sd": self.sd, "hdi94": list(self.hdi94), "unit": self.unit}


@dataclass(frozen=True)
class Verdict:
    """See FORMATS: what is said to be present, how probable, where, how far the gap shrinks.

    `white_choice` is what a plain rule would have said, kept to be compared with; `known` says of every known
    input of the records whether the gap follows it.
    """

    answer: tuple[str, ...]
    probability: Mapping[str, float]
    confusable: Sequence[tuple[str, str]]
    where: Location
    gap_train: Closure
    gap_holdout: Closure
    parameters: Mapping[str, Estimate]
    base: Mapping[str, Estimate]
    next_experiment: str
    seconds: float
    notes: Sequence[str] = ()
    white_choice: Sequence[str] = ()
    known: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    @property
    def certainty(self) -> float:
        """Probability of the least certain label of the answer, or that nothing is missing."""
        return min(self.probability[label] for label in self.answer or (NONE,))

    def to_dict(self) -> dict[str, object]:
        """The content of verdict.json."""
        return {
            "schema": VERDICT,
            "answer": list(self.answer),
            "probability": dict(self.probability),
            "confusable": [list(pair) for pair in self.confusable],
            "where": self.where.to_dict(),
            "gap": {"train": self.gap_train.to_dict(), "holdout": self.gap_holdout.to_dict()},
            "parameters": {name: estimate.to_dict() for name, estimate in self.parameters.items()},
            "base": {name: estimate.to_dict() for name, estimate in self.base.items()},
            "next_experiment": self.next_experiment,
            "notes": list(self.notes),
            "white_choice": list(self.white_choice),
            "seconds": self.seconds,
            **({"known": {name: dict(each) for name, each in self.known.items()}} if self.known else {}),
        }

    def write(self, path: Path) -> None:
        """Write verdict.json; numbers that are not finite become null."""
        write_json(path, _finite(self.to_dict()))


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
