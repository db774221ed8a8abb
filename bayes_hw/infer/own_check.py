"""Whether the intervals hold on an axis like the user's own.

Records are simulated from posterior draws under the user's own commands, with the noise of the draw; each set
is identified and sampled anew, from nothing but its records. How often the 94 % intervals then hold the drawn
values is what the intervals are worth (Cook, Gelman and Rubin, doi 10.1198/106186006X136976).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from scipy.stats import binomtest

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.executor import Executor, ResultFolder
from bayes_hw.identify.four_steps import identify
from bayes_hw.identify.noise import stationary_autoregression
from bayes_hw.infer.inference import infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.progress import Progress
from bayes_hw.record import Record

FEWEST = 10
"""Replicates from which the check says anything."""

SIGNIFICANCE = 0.05

SAME_MODE = 0.15
"""Modes whose logarithms of frequency differ by less are one."""

STATIC = ("saturation.lower", "saturation.upper", "dead_zone.half_width")

CheckTask: TypeAlias = tuple[tuple[Record, ...], dict[str, float], int, SamplerSettings]
"""Simulated records, the values that they were simulated with, a seed, how long to sample."""


@dataclass(frozen=True)
class Held:
    """How often a parameter's 94 % interval held the drawn value."""

    held: int
    of: int

    @property
    def interval95(self) -> tuple[float, float]:
        """Clopper and Pearson's interval of the share."""
        found = binomtest(self.held, self.of).proportion_ci(0.95, method="exact")
        return float(found.low), float(found.high)

    @property
    def p_value(self) -> float:
        """Of so few held where `INTERVAL_PROBABILITY` of them should be."""
        return float(binomtest(self.held, self.of, INTERVAL_PROBABILITY, alternative="less").pvalue)


@dataclass(frozen=True)
class OwnCheck:
    """The outcome of all replicates; `converged` of them did."""

    replicates: int
    converged: int
    held: dict[str, Held]

    @property
    def all_parameters(self) -> Held:
        """Every interval of every replicate together."""
        return Held(sum(h.held for h in self.held.values()), sum(h.of for h in self.held.values()))

    @property
    def refuted(self) -> tuple[str, ...]:
        """Parameters held so seldom that chance gives it once in 1 / SIGNIFICANCE checks, for all of them
        together (Holm, Scand. J. Statist. 6, 65)."""
        found: list[str] = []
        ordered = sorted(self.held, key=lambda name: self.held[name].p_value)
        for number, name in enumerate(ordered):
            if self.held[name].p_value >= SIGNIFICANCE / (len(ordered) - number):
                break
            found.append(name)
        return tuple(found)

    @property
    def stands(self) -> bool:
        """Whether there are FEWEST replicates and no parameter is refuted."""
        return self.replicates >= FEWEST and not self.refuted

    def to_dict(self) -> dict[str, Any]:
        """The entry `check` of posterior.json."""
        return {
            "replicates": self.replicates,
            "converged": self.converged,
            "stands": self.stands,
            "held": {
                name: {"held": one.held, "of": one.of, "interval95": list(one.interval95)}
                for name, one in self.held.items()
            },
        }


def check_own_axis(
    posterior: Posterior,
    records: Sequence[Record],
    replicates: int,
    seed: int,
    executor: Executor,
    *,
    settings: SamplerSettings | None = None,
    kept: ResultFolder | None = None,
    progress: Progress | None = None,
) -> OwnCheck:
    """Simulate, identify and sample `replicates` times. Raises InputError unless every record starts at rest,
    which is all that is simulated."""
    if posterior.axis.start_positions is not None:
        raise InputError("--check simulates records that start at rest; leave --start free out")
    tasks = check_tasks(posterior, records, replicates, seed, settings or SamplerSettings())
    results = executor.map(check_once, tasks, progress=progress, label="check of the intervals", kept=kept)
    counts: dict[str, list[bool]] = {}
    for result in results:
        for name, inside in result["inside"].items():
            counts.setdefault(name, []).append(inside)
    held = {name: Held(sum(each), len(each)) for name, each in counts.items()}
    return OwnCheck(replicates, sum(result["converged"] for result in results), held)


def check_tasks(
    posterior: Posterior, records: Sequence[Record], replicates: int, seed: int, settings: SamplerSettings
) -> list[CheckTask]:
    """One task of `check_once` a posterior draw; more replicates begin with the same ones."""
    n_axis = len(posterior.axis.parameters)
    flat = posterior.values.reshape(-1, posterior.values.shape[-1])
    tasks = []
    for number, row in enumerate(np.random.default_rng(seed).permutation(len(flat))[:replicates]):
        draw, rng = flat[row], np.random.default_rng([seed, number])
        model = posterior.axis.to_model(draw[:n_axis])
        noise = draw[n_axis:]
        simulated = tuple(_simulated(model, record, noise, posterior.noise_order, rng) for record in records)
        tasks.append((simulated, true_values(model), seed + number, settings))
    return tasks


def true_values(model: HammersteinWiener) -> dict[str, float]:
    """Limits, half width and dominant modes of a model, by the names of posterior.json."""
    values = (model.saturation.lower, model.saturation.upper, model.dead_zone.half_width)
    found = dict(zip(STATIC, values, strict=True))
    for number, mode in enumerate(sorted(model.dominant_modes, key=lambda m: m.frequency_hz), start=1):
        found[f"mode{number}.frequency_hz"] = mode.frequency_hz
        found[f"mode{number}.damping_ratio"] = mode.damping_ratio
    return found


def check_once(task: CheckTask) -> dict[str, Any]:
    """Whether the 94 % intervals of one replicate hold its true values; a mode that is not found does not."""
    records, truth, seed, settings = task
    model = identify(records, name="replicate").model
    posterior = infer(model, records, np.random.default_rng(seed), settings=settings).posterior
    inside = {}
    for name, value in truth.items():
        own = name if name in STATIC else _same_mode(posterior, truth, name)
        if own is None:
            inside[name] = False
            continue
        low, high = posterior.reported[own].hdi94
        inside[name] = bool(low <= value <= high)
    return {"inside": inside, "converged": posterior.converged}


def _same_mode(posterior: Posterior, truth: dict[str, float], name: str) -> str | None:
    mode, _, quantity = name.partition(".")
    wanted = np.log(truth[f"{mode}.frequency_hz"])
    means = {
        other.partition(".")[0]: abs(np.log(summary.mean) - wanted)
        for other, summary in posterior.reported.items()
        if other.startswith("mode") and other.endswith(".frequency_hz")
    }
    nearest = min(means, key=lambda key: means[key], default=None)
    return None if nearest is None or means[nearest] > SAME_MODE else f"{nearest}.{quantity}"


def _simulated(
    model: HammersteinWiener, record: Record, noise: FloatArray, order: int, rng: np.random.Generator
) -> Record:
    """The record with the model's output and noise of the sampled parameters `noise`, of that order."""
    degrees = float(noise[-1]) if len(noise) > order + 1 else None
    e = stationary_autoregression(len(record), float(noise[0]), noise[1 : order + 1], rng, degrees)
    return replace(record, y=model.simulate(record.u).y + e, sha256="", known={}, known_units={})
