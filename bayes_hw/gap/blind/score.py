"""The score of a blind check, from the counts of single cases to score.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from bayes_hw.gap.blind.counts import (
    CLASSES,
    CONFIDENT,
    ReliabilityBin,
    Share,
    answer_name,
    base_held,
    block_right,
    brier,
    class_statements,
    confidence,
    confusion,
    most_probable,
    named_right,
    named_up_to_confusion,
    reliability,
    share,
    strength_bin,
    true_closure,
)
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict, Evidence
from bayes_hw.gap.blind.mutation import Mutation, mutations

SCHEMA = "bayes-hw/blind-score/1"

GOALS: Mapping[str, float] = {
    "single effects named right": 0.97,
    "block right": 0.98,
    "no false alarm": 0.97,
    "other said of off-catalogue": 0.90,
    "both of a pair named": 0.80,
    "right when 95 % sure or more": 0.95,
    "closure interval holds": 0.90,
    "base intervals hold": 0.90,
}
"""What is aimed at, by the names of `Score.headline`."""


@dataclass(frozen=True)
class Closure:
    """Claimed and true closed fraction of one case's hold-out; `interval` is the claim's 94 % one."""

    case: str
    effects: tuple[str, ...]
    named_right: bool
    claimed: float
    interval: tuple[float, float]
    true: float

    @property
    def held(self) -> bool:
        """Whether the interval holds the true fraction."""
        return self.interval[0] <= self.true <= self.interval[1]


@dataclass(frozen=True)
class CaseLine:
    """One case in a line."""

    case: str
    truth: tuple[str, ...]
    detail: tuple[str, ...]
    gap_over_sigma: tuple[float, ...]
    answer: tuple[str, ...]
    confidence: float
    right: bool


@dataclass(frozen=True)
class Score:
    """How a set was diagnosed; every share with its trials.

    `headline` holds the figures that a goal can be set for; `by_effect` and `by_form` singles named right,
    `by_strength` everything with a gap named right; `figures_by_effect` and `figures_by_strength` the other
    figures of single effects; `base` the coverage of 94 % intervals.
    """

    cases: int
    failed: int
    headline: Mapping[str, Share]
    confusion: Mapping[str, Mapping[str, int]]
    by_effect: Mapping[str, Share]
    by_form: Mapping[str, Share]
    by_strength: Mapping[str, Share]
    figures_by_effect: Mapping[str, Mapping[str, Share]]
    figures_by_strength: Mapping[str, Mapping[str, Share]]
    brier: float
    brier_of_frequencies: float
    reliability: tuple[ReliabilityBin, ...]
    answer_reliability: tuple[ReliabilityBin, ...]
    base: Mapping[str, Share]
    closures: tuple[Closure, ...]
    chance: Mapping[str, float]
    mutations: tuple[Mutation, ...]
    lines: tuple[CaseLine, ...]
    median_seconds: float
    longest_seconds: float


def score_evidence(evidence: Evidence, rng: np.random.Generator) -> Score:
    """The whole score; `rng` shuffles the verdicts for the mutation check."""
    truths, verdicts = evidence.truths, evidence.verdicts
    pairs = list(zip(truths, verdicts, strict=True))
    answered = [(t, v) for t, v in pairs if not v.failed]
    closures = tuple(_closures(pairs))
    seconds = [v.seconds for _, v in answered if np.isfinite(v.seconds)]
    stated, true = class_statements(truths, verdicts)
    return Score(
        cases=len(pairs),
        failed=sum(v.failed for v in verdicts),
        headline=headline(truths, verdicts, closures),
        confusion={row: dict(counts) for row, counts in confusion(truths, verdicts).items()},
        by_effect=_grouped(pairs, lambda t: t.effects[0] if t.kind == "single" else None),
        by_form=_grouped(pairs, lambda t: t.detail[0] if t.kind in ("single", "other") else None),
        by_strength=_grouped(pairs, lambda t: strength_bin(t) if t.effects else None),
        figures_by_effect=_figures(pairs, lambda t: t.effects[0]),
        figures_by_strength=_figures(pairs, strength_bin),
        brier=brier(truths, verdicts),
        brier_of_frequencies=brier(truths, [_frequencies(truths)] * len(truths)),
        reliability=tuple(reliability(stated, true)),
        answer_reliability=tuple(
            reliability([confidence(v) for _, v in answered], [named_right(t, v) for t, v in answered])
        ),
        base=_base_coverage(answered),
        closures=closures,
        chance=chance(truths),
        mutations=tuple(mutations(truths, verdicts, rng)),
        lines=tuple(
            CaseLine(
                t.name, t.effects, t.detail, t.gap_over_sigma, v.answer, confidence(v), named_right(t, v)
            )
            for t, v in pairs
        ),
        median_seconds=float(np.median(seconds)) if seconds else float("nan"),
        longest_seconds=max(seconds, default=float("nan")),
    )


def headline(
    truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict], closures: Sequence[Closure]
) -> dict[str, Share]:
    """The shares that goals are set for."""
    of = {
        kind: [(t, v) for t, v in zip(truths, verdicts, strict=True) if t.kind == kind]
        for kind in ("single", "none", "other", "pair")
    }
    sure = [
        (t, v) for t, v in zip(truths, verdicts, strict=True) if not v.failed and confidence(v) >= CONFIDENT
    ]
    held = [held for t, v in zip(truths, verdicts, strict=True) for held in base_held(t, v).values()]
    return {
        "single effects named right": share(named_right(t, v) for t, v in of["single"]),
        "single effects named, up to stated confusion": share(
            named_up_to_confusion(t, v) for t, v in of["single"]
        ),
        "single effects most probable": share(most_probable(v) == t.effects[0] for t, v in of["single"]),
        "block right": share(block_right(t, v) for t, v in of["single"]),
        "no false alarm": share(named_right(t, v) for t, v in of["none"]),
        "other said of off-catalogue": share("other" in v.answer for _, v in of["other"]),
        "both of a pair named": share(named_right(t, v) for t, v in of["pair"]),
        "at least one of a pair named": share(bool(set(t.effects) & set(v.answer)) for t, v in of["pair"]),
        "right when 95 % sure or more": share(named_right(t, v) for t, v in sure),
        "closure interval holds": share(c.held for c in closures),
        "base intervals hold": share(held),
    }


def chance(truths: Sequence[CaseTruth]) -> dict[str, float]:
    """What guessing scores on cases without pairs: uniformly among the classes, by the true frequencies, and
    always the most frequent class."""
    names = [answer_name(t.effects) for t in truths if t.kind != "pair"]
    if not names:
        return {}
    frequency = np.array([names.count(name) for name in sorted(set(names))]) / len(names)
    return {
        "uniform": 1 / len(CLASSES),
        "by frequency": float(np.sum(frequency**2)),
        "most frequent": float(frequency.max()),
    }


def score_to_dict(score: Score, evidence: Evidence) -> dict[str, object]:
    """The content of score.json."""
    return {
        "schema": SCHEMA,
        "seal": evidence.seal,
        "verdicts_sha256": evidence.verdicts_sha256,
        "diagnosis": evidence.diagnosis,
        "cases": score.cases,
        "failed": score.failed,
        "headline": {name: value.to_dict() for name, value in score.headline.items()},
        "confusion": score.confusion,
        "by_effect": {name: value.to_dict() for name, value in score.by_effect.items()},
        "by_form": {name: value.to_dict() for name, value in score.by_form.items()},
        "by_strength": {name: value.to_dict() for name, value in score.by_strength.items()},
        "figures_by_effect": _nested(score.figures_by_effect),
        "figures_by_strength": _nested(score.figures_by_strength),
        "brier": _finite(score.brier),
        "brier_of_frequencies": _finite(score.brier_of_frequencies),
        "reliability": [_bin(entry) for entry in score.reliability],
        "answer_reliability": [_bin(entry) for entry in score.answer_reliability],
        "base": {name: value.to_dict() for name, value in score.base.items()},
        "closures": [
            asdict(c) | {"claimed": _finite(c.claimed), "interval": [_finite(x) for x in c.interval]}
            for c in score.closures
        ],
        "chance": score.chance,
        "mutations": [asdict(m) | {"passed": m.passed} for m in score.mutations],
        "seconds": {"median": _finite(score.median_seconds), "longest": _finite(score.longest_seconds)},
        "lines": [asdict(line) | {"confidence": _finite(line.confidence)} for line in score.lines],
    }


def _closures(pairs: Sequence[tuple[CaseTruth, CaseVerdict]]) -> list[Closure]:
    """Of every case that carries something and whose verdict adds effects: only that claims a closure."""
    found = []
    for truth, verdict in pairs:
        true = true_closure(truth, verdict)
        if truth.effects and verdict.answer not in ((), ("other",)) and np.isfinite(true):
            found.append(
                Closure(
                    truth.name,
                    truth.effects,
                    named_right(truth, verdict),
                    verdict.closed,
                    verdict.closed_interval,
                    true,
                )
            )
    return found


def _grouped(
    pairs: Sequence[tuple[CaseTruth, CaseVerdict]], group: Callable[[CaseTruth], str | None]
) -> dict[str, Share]:
    outcomes: dict[str, list[bool]] = {}
    for truth, verdict in pairs:
        name = group(truth)
        if name is not None:
            outcomes.setdefault(name, []).append(named_right(truth, verdict))
    return {name: share(outcomes[name]) for name in sorted(outcomes)}


def _figures(
    pairs: Sequence[tuple[CaseTruth, CaseVerdict]], group: Callable[[CaseTruth], str]
) -> dict[str, dict[str, Share]]:
    """Named right, most probable, block, closure and base intervals of single effects, by group."""
    groups: dict[str, list[tuple[CaseTruth, CaseVerdict]]] = {}
    for truth, verdict in pairs:
        if truth.kind == "single":
            groups.setdefault(group(truth), []).append((truth, verdict))
    return {
        name: {
            "named right": share(named_right(t, v) for t, v in groups[name]),
            "most probable": share(most_probable(v) == t.effects[0] for t, v in groups[name]),
            "block right": share(block_right(t, v) for t, v in groups[name]),
            "closure interval holds": share(c.held for c in _closures(groups[name])),
            "base intervals hold": share(h for t, v in groups[name] for h in base_held(t, v).values()),
        }
        for name in sorted(groups)
    }


def _nested(groups: Mapping[str, Mapping[str, Share]]) -> dict[str, object]:
    return {
        name: {key: value.to_dict() for key, value in figures.items()} for name, figures in groups.items()
    }


def _base_coverage(pairs: Sequence[tuple[CaseTruth, CaseVerdict]]) -> dict[str, Share]:
    held: dict[str, list[bool]] = {}
    for truth, verdict in pairs:
        for name, inside in base_held(truth, verdict).items():
            held.setdefault(name, []).append(inside)
    return {name: share(held[name]) for name in sorted(held)}


def _frequencies(truths: Sequence[CaseTruth]) -> CaseVerdict:
    """A verdict that states for every class how often it is present in the set."""
    count = max(len(truths), 1)
    return CaseVerdict(
        (),
        {
            name: sum(name in t.effects if name != "none" else not t.effects for t in truths) / count
            for name in CLASSES
        },
    )


def _bin(entry: ReliabilityBin) -> dict[str, object]:
    return {"low": entry.low, "high": entry.high, "mean": entry.mean, **entry.share.to_dict()}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
