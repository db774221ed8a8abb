"""The next experiment: the command expected to tell most, within what the axis may do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.identifiability.excitation_families import Circumstances, Family, families
from bayes_hw.identifiability.information_gain import (
    Belief,
    ExpectedGain,
    expected_gain,
    predicted_widths,
)
from bayes_hw.identifiability.motion_limits import MotionLimits, kept_within
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.posterior import Posterior
from bayes_hw.progress import Progress
from bayes_hw.record import Record

SCHEMA = "bayes-hw/experiment/1"
Score: TypeAlias = Callable[[FloatArray], float]
"""What a command (samples,) is worth; the larger the better."""

SEARCH_DRAWS = 12
FINAL_DRAWS = 64
STROKE_DRAWS = 32
EVALUATIONS = 240
"""Commands scored in each family unless told otherwise."""

GLOBAL_SHARE = 0.6
"""Share of them spent on the whole range of the settings, the rest near the best found."""

SHRINKING = (1.0, 0.85, 0.7, 0.55, 0.4, 0.3, 0.2, 0.1, 0.05)
"""Factors by which a command that would leave the stroke is made smaller."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """The best command of one family: its settings, samples, and by which factor the stroke made it smaller.

    `gain` is None where a score of the caller's own decided, which `score` then holds.
    """

    family: str
    label: str
    settings: dict[str, float]
    shrunk_by: float
    u: FloatArray
    score: float
    gain: ExpectedGain | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data of experiment.json."""
        content = {
            "family": self.family,
            "settings": self.settings,
            "shrunk_by": self.shrunk_by,
            "score": self.score,
        }
        if self.gain is not None:
            content |= {
                "expected_gain_nats": self.gain.nats,
                "standard_error_nats": self.gain.standard_error,
            }
        return content


@dataclass(frozen=True)
class PredictedInterval:
    """The 94 % highest-density interval of one parameter now, and what the experiment is expected to leave.

    `width` is the geometric mean over the belief's draws, `width_range` holds 80 % of them: how far it
    depends on what the truth is.
    """

    name: str
    unit: str
    now: tuple[float, float]
    median: float
    width: float
    width_range: tuple[float, float]

    @property
    def after(self) -> tuple[float, float]:
        """The predicted interval, about today's median."""
        return self.median - self.width / 2, self.median + self.width / 2

    @property
    def width_now(self) -> float:
        return self.now[1] - self.now[0]

    def to_dict(self) -> dict[str, Any]:
        """Plain data of experiment.json."""
        return {
            "unit": self.unit,
            "hdi94_now": list(self.now),
            "interval94_after": list(self.after),
            "width_now": self.width_now,
            "width_after": self.width,
            "width_after_80_percent": list(self.width_range),
        }


@dataclass(frozen=True, eq=False)
class Design:
    """Candidates in order of their worth, the best first; `repeated` is the first record's command again.

    `about` names the parameters that the gain is about; `outputs` (draws, samples) is what draws of the
    posterior answer the winner with.
    """

    about: tuple[str, ...]
    circumstances: Circumstances
    candidates: tuple[Candidate, ...]
    repeated: Candidate | None
    intervals: tuple[PredictedInterval, ...]
    outputs: FloatArray

    @property
    def winner(self) -> Candidate:
        return self.candidates[0]

    def to_dict(self) -> dict[str, Any]:
        """Plain data of experiment.json."""
        limits = self.circumstances.limits
        return {
            "schema": SCHEMA,
            "about": list(self.about),
            "method": "Laplace approximation, mean over draws of the posterior",
            "sample_rate_hz": self.circumstances.sample_rate_hz,
            "duration_s": self.circumstances.duration_s,
            "limits": {
                "velocity": limits.velocity,
                "acceleration": limits.acceleration,
                "stroke": [limits.lowest, limits.highest],
            },
            "winner": self.winner.to_dict(),
            "candidates": [candidate.to_dict() for candidate in self.candidates],
            "repeated": None if self.repeated is None else self.repeated.to_dict(),
            "parameters": {interval.name: interval.to_dict() for interval in self.intervals},
        }


class Stroke:
    """Makes commands that the limits allow, and that no believed axis answers beyond its stroke."""

    def __init__(self, belief: Belief, limits: MotionLimits) -> None:
        self.axis, self.limits = belief.axis, limits
        self.values = belief.values[:STROKE_DRAWS].T

    def outputs(self, u: FloatArray) -> FloatArray:
        """y (draws, samples) of the believed axes for the command u (samples,)."""
        rate = self.axis.model.sample_rate_hz
        record = Record("trial", np.arange(len(u)) / rate, u, u, rate, self.axis.model.units)
        return simulated_outputs(self.axis, self.values, [record])[0]

    def fitted(self, u: FloatArray) -> tuple[FloatArray, float] | None:
        """The command within the limits and the factor it was made smaller by; None where none fits."""
        for factor in SHRINKING:
            allowed = kept_within(factor * u, self.limits, self.axis.model.sample_rate_hz)
            if self.limits.hold(self.outputs(allowed)):
                return allowed, factor
        return None


def search(
    family: Family,
    stroke: Stroke,
    score: Score,
    rng: np.random.Generator,
    evaluations: int = EVALUATIONS,
    hint: Mapping[str, float] | None = None,
) -> Candidate | None:
    """The best command of one family over its settings; None where none fits the stroke.

    Differential evolution, then a simplex from the best. `hint` gives shares of the settings' ranges to begin
    with, those not named at their low ends: so that a sweep with modulation is never worse than a plain one.
    """
    count = len(family.settings)
    members = 2 ** int(np.ceil(np.log2(max(8, 3 * count))))
    generations = max(0, round(GLOBAL_SHARE * evaluations / members) - 1)
    begin = None
    if hint:
        begin = np.array([hint.get(setting.name, 0.0) for setting in family.settings])
    found: dict[bytes, tuple[float, Candidate | None]] = {}

    def cost(shares: FloatArray) -> float:
        key = shares.tobytes()
        if key not in found:
            settings = family.values(np.clip(shares, 0.0, 1.0))
            fitted = stroke.fitted(family.make(settings))
            if fitted is None:
                found[key] = (-np.inf, None)
            else:
                u, factor = fitted
                value = score(u)
                candidate = Candidate(family.name, family.label, settings, factor, u, value)
                found[key] = (value if np.isfinite(value) else -np.inf, candidate)
        value = found[key][0]
        return -value if np.isfinite(value) else 1e6

    bounds = Bounds(np.zeros(count), np.ones(count))
    whole = differential_evolution(
        cost,
        bounds,
        maxiter=generations,
        popsize=-(-members // count),
        init="sobol",
        polish=False,
        tol=0.0,
        rng=rng,
        x0=begin,
    )
    minimize(
        cost,
        whole.x,
        method="Nelder-Mead",
        bounds=bounds,
        options={"maxfev": max(1, evaluations - len(found)), "xatol": 1e-3, "fatol": 1e-3},
    )
    return max(found.values(), key=lambda entry: entry[0])[1]


def design_experiment(
    posterior: Posterior,
    circumstances: Circumstances,
    rng: np.random.Generator,
    *,
    about: Sequence[str] = (),
    records: Sequence[Record] = (),
    evaluations: int = EVALUATIONS,
    progress: Progress | None = None,
) -> Design:
    """The command of largest expected information gain about the parameters `about` (all when empty).

    Each family is searched with few draws of the posterior, the same for all; the best of every family are
    then compared with FINAL_DRAWS others. `records` are those that the posterior was sampled with; the first
    one's command is scored beside the others.
    """
    progress = progress or Progress(quiet=True)
    final_rng, search_rng, *family_rngs = rng.spawn(2 + 8)
    belief = Belief.of(posterior, FINAL_DRAWS, final_rng, records)
    searched = Belief.of(posterior, SEARCH_DRAWS, search_rng, records)
    rows = belief.rows(about)
    stroke = Stroke(belief, circumstances.limits)
    chosen = families(circumstances)

    def score(u: FloatArray) -> float:
        return expected_gain(searched, u, rows).nats

    candidates = []
    hint: dict[str, float] = {}
    with progress.task("families of commands", len(chosen)) as task:
        for done, (family, family_rng) in enumerate(zip(chosen, family_rngs, strict=False), start=1):
            best = search(family, stroke, score, family_rng, evaluations, hint)
            if best is not None:
                candidates.append(_with_gain(best, belief, rows))
                hint = hint or family.shares(best.settings)
            task.reach(done, family.label)
    candidates.sort(key=lambda candidate: -candidate.score)
    if not candidates:
        raise InputError("stroke: no command of any family keeps the axis within it; widen --stroke")
    winner = candidates[0]
    assert winner.gain is not None
    repeated = None
    if records:
        same = Candidate("repeat", "first record's command again", {}, 1.0, records[0].u, 0.0)
        repeated = _with_gain(same, belief, rows)
    return Design(
        about=tuple(belief.axis.names[row] for row in rows),
        circumstances=circumstances,
        candidates=tuple(candidates),
        repeated=repeated,
        intervals=_intervals(posterior, belief, predicted_widths(belief, winner.gain.covariances), about),
        outputs=stroke.outputs(winner.u),
    )


def _with_gain(candidate: Candidate, belief: Belief, rows: Sequence[int]) -> Candidate:
    gain = expected_gain(belief, candidate.u, rows)
    return replace(candidate, score=gain.nats, gain=gain)


def _intervals(
    posterior: Posterior, belief: Belief, widths: FloatArray, about: Sequence[str]
) -> tuple[PredictedInterval, ...]:
    """Intervals of the axis's parameters now and after, from `widths` (draws, parameters); of the weights of
    G's poles, which describe it only together, where `about` names them."""
    low, high = np.quantile(widths, [0.1, 0.9], axis=0)
    mean = np.exp(np.mean(np.log(widths), axis=0))
    found = []
    for i, name in enumerate(belief.axis.names):
        if name in about or not (name.startswith("start") or i in belief.axis.weight_rows):
            summary = posterior.summaries[name]
            found.append(
                PredictedInterval(
                    name,
                    summary.unit,
                    summary.hdi94,
                    summary.median,
                    float(mean[i]),
                    (float(low[i]), float(high[i])),
                )
            )
    return tuple(found)


def stored_records(folder: Path | str, posterior: Posterior) -> tuple[Record, ...]:
    """The records in `folder`/posterior.nc, which `posterior` was read from; none where it holds none.

    Their time stamps are counted from zero. Raises InputError when the file is damaged.
    """
    path = Path(folder) / "posterior.nc"
    model = posterior.axis.model
    found: list[Record] = []
    try:
        with h5py.File(path, "r") as file:
            if "observed_data" not in file:
                return ()
            outputs, commands = file["observed_data"], file["constant_data"]
            while f"y{len(found) + 1}" in outputs:
                number = len(found) + 1
                u, y = np.asarray(commands[f"u{number}"]), np.asarray(outputs[f"y{number}"])
                t = np.arange(len(u)) / model.sample_rate_hz
                name = f"record {number}"
                found.append(Record(name, t, u, y, model.sample_rate_hz, model.units, source=str(path)))
    except (OSError, KeyError, ValueError):
        raise InputError(f"{path}: damaged or not written by bayes-hw; sample again") from None
    return tuple(found)
