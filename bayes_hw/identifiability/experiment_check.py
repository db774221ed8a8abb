"""Was the prediction right? The designed experiment simulated, and the posterior sampled again with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.identifiability.information_gain import Belief, expected_gain, predicted_widths
from bayes_hw.identifiability.next_experiment import Design
from bayes_hw.identify.noise import stationary_autoregression
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.inference import infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.progress import Progress
from bayes_hw.record import Record

DEFAULT_SETTINGS = SamplerSettings()
TOLERANCE = 0.2
"""Predicted and obtained widths agree within this share."""


@dataclass(frozen=True, eq=False)
class WidthCheck:
    """Obtained widths of 94 % intervals beside those predicted, both (replicates, parameters).

    Every replicate takes another draw of the posterior for the truth, and what is predicted is the width for
    that truth. `ratio` (parameters,) is the geometric mean over the replicates of obtained over predicted.
    """

    names: tuple[str, ...]
    predicted: FloatArray
    obtained: FloatArray
    converged: tuple[bool, ...]

    @property
    def ratio(self) -> FloatArray:
        return np.asarray(np.exp(np.mean(np.log(self.obtained / self.predicted), axis=0)))

    @property
    def largest_error(self) -> float:
        """Largest deviation of a ratio from one."""
        return float(np.max(np.abs(self.ratio - 1)))

    @property
    def passed(self) -> bool:
        return self.largest_error <= TOLERANCE

    def to_dict(self) -> dict[str, Any]:
        """Plain data of experiment.json."""
        return {
            "replicates": len(self.obtained),
            "tolerance": TOLERANCE,
            "passed": self.passed,
            "largest_error": self.largest_error,
            "converged": list(self.converged),
            "parameters": {
                name: {
                    "predicted_widths": self.predicted[:, i].tolist(),
                    "obtained_widths": self.obtained[:, i].tolist(),
                    "ratio": float(self.ratio[i]),
                }
                for i, name in enumerate(self.names)
            },
        }


def check_design(
    design: Design,
    posterior: Posterior,
    records: Sequence[Record],
    rng: np.random.Generator,
    *,
    replicates: int = 6,
    settings: SamplerSettings | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> WidthCheck:
    """Simulate the winning command on `replicates` draws of the posterior and sample again with each record.

    `records` are those that the posterior was sampled with; each new posterior rests on them and on the new
    record.
    """
    progress = progress or Progress(quiet=True)
    settings = settings or DEFAULT_SETTINGS
    belief_rng, noise_rng, infer_rng = rng.spawn(3)
    belief = Belief.of(posterior, replicates, belief_rng, records)
    names = tuple(interval.name for interval in design.intervals)
    obtained, converged = [], []
    with progress.task("simulated experiments", replicates) as task:
        for number, one_rng in enumerate(infer_rng.spawn(replicates)):
            record = _simulated(design, belief, number, noise_rng)
            again = infer(
                posterior.axis.model,
                [*records, record],
                one_rng,
                free=posterior.axis.free,
                start="rest" if posterior.axis.start_positions is None else "free",
                settings=settings,
                jobs=jobs,
            ).posterior
            widths = [again.summaries[name].hdi94 for name in names]
            obtained.append([high - low for low, high in widths])
            converged.append(again.converged)
            task.reach(number + 1)
    after = expected_gain(belief, design.winner.u, belief.rows(names)).covariances
    predicted = predicted_widths(belief, after)[:, belief.rows(names)]
    return WidthCheck(names, predicted, np.array(obtained), tuple(converged))


def write_design(folder: Path, design: Design, check: WidthCheck | None = None) -> None:
    """command.csv with columns t,u, ready to play, and experiment.json with the check where there is one."""
    u = design.winner.u
    t = np.arange(len(u)) / design.circumstances.sample_rate_hz
    content = design.to_dict() | ({} if check is None else {"check": check.to_dict()})
    with staged(folder) as place:
        write_csv(place / "command.csv", {"t": t, "u": u})
        write_json(place / "experiment.json", content)


def _simulated(design: Design, belief: Belief, draw: int, rng: np.random.Generator) -> Record:
    """The winner's record of one draw's axis with that draw's noise."""
    u, rate, units = design.winner.u, design.circumstances.sample_rate_hz, belief.axis.model.units
    t = np.arange(len(u)) / rate
    empty = Record("simulated experiment", t, u, np.zeros(len(u)), rate, units, source="simulated")
    clean = simulated_outputs(belief.axis, belief.values[draw][:, None], [empty])[0][0]
    noise = stationary_autoregression(len(u), belief.sigma[draw], belief.partial[:, draw], rng)
    return Record("simulated experiment", t, u, clean + noise, rate, units, source="simulated")
