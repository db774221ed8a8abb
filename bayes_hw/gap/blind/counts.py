"""Counting how verdicts compare with truths: small pure functions, each of which a test works by hand."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict
from bayes_hw.gap.effects.labels import LABEL_BLOCKS

CLASSES = (*LABEL_BLOCKS, "none", "other")
"""What a probability is stated for."""

RELIABILITY_EDGES = (0.0, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 1.0)
STRENGTH_EDGES = (0.0, 1.0, 2.0, 3.0, float("inf"))
CONFIDENT = 0.95


@dataclass(frozen=True)
class Share:
    """`hits` of `trials` with its 95 % binomial interval."""

    hits: int
    trials: int

    @property
    def value(self) -> float:
        """NaN without a trial."""
        return self.hits / self.trials if self.trials else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Clopper-Pearson, doi 10.1093/biomet/26.4.404; (0, 1) without a trial."""
        if not self.trials:
            return 0.0, 1.0
        found = stats.binomtest(self.hits, self.trials).proportion_ci(0.95)
        return float(found.low), float(found.high)

    def to_dict(self) -> dict[str, object]:
        """For score.json."""
        return {
            "hits": self.hits,
            "trials": self.trials,
            "share": self.value if self.trials else None,
            "interval95": list(self.interval),
        }


def share(outcomes: Iterable[bool]) -> Share:
    """How many of the outcomes are true."""
    known = [bool(outcome) for outcome in outcomes]
    return Share(sum(known), len(known))


def named_right(truth: CaseTruth, verdict: CaseVerdict) -> bool:
    """Whether the answer is what the case carries: no more, no less, in any order."""
    return not verdict.failed and set(verdict.answer) == set(truth.effects)


def named_up_to_confusion(truth: CaseTruth, verdict: CaseVerdict) -> bool:
    """Named right, or one label instead of another that the verdict itself says cannot be told from it."""
    if named_right(truth, verdict):
        return True
    if verdict.failed or len(truth.effects) != 1 or len(verdict.answer) != 1:
        return False
    return frozenset((*truth.effects, *verdict.answer)) in verdict.confusable


def most_probable(verdict: CaseVerdict) -> str:
    """The class of largest stated probability; "" where none is stated."""
    return max(verdict.probability, key=lambda name: verdict.probability[name], default="")


def block_right(truth: CaseTruth, verdict: CaseVerdict) -> bool:
    """Whether `where.block` is the block of a label that the case carries."""
    return verdict.block in {LABEL_BLOCKS[label] for label in truth.effects if label in LABEL_BLOCKS}


def answer_name(labels: Sequence[str]) -> str:
    """Row or column of the confusion matrix: the label, "none", "other", or "two or more"."""
    if not labels:
        return "none"
    return labels[0] if len(labels) == 1 else "two or more"


def confusion(truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict]) -> dict[str, Counter[str]]:
    """Answers counted by truth; pairs stand under "two or more"."""
    table: dict[str, Counter[str]] = {}
    for truth, verdict in zip(truths, verdicts, strict=True):
        table.setdefault(answer_name(truth.effects), Counter())[answer_name(verdict.answer)] += 1
    return table


def confidence(verdict: CaseVerdict) -> float:
    """The stated probability of the answer: that of its least probable label, or of "none"; NaN unstated."""
    names = verdict.answer or ("none",)
    return min(verdict.probability.get(name, float("nan")) for name in names)


def present(truth: CaseTruth, name: str) -> bool:
    """Whether the case carries what the class `name` stands for."""
    return name in truth.effects if name != "none" else not truth.effects


def brier(truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict]) -> float:
    """Mean over the cases of sum over the classes of (p - present)^2 (Brier 1950).

    0 is perfect; a class without a stated probability counts as p = 0. NaN without a case.
    """
    sums = [
        sum((verdict.probability.get(name, 0.0) - present(truth, name)) ** 2 for name in CLASSES)
        for truth, verdict in zip(truths, verdicts, strict=True)
    ]
    return float(np.mean(sums)) if sums else float("nan")


@dataclass(frozen=True)
class ReliabilityBin:
    """Statements with probabilities in [low, high): their mean, and how many of them were true."""

    low: float
    high: float
    mean: float
    share: Share


def reliability(stated: Sequence[float], true: Sequence[bool]) -> list[ReliabilityBin]:
    """Stated probabilities binned at RELIABILITY_EDGES, empty bins left out; 1 belongs to the last bin."""
    probability, outcome = np.asarray(stated, dtype=np.float64), np.asarray(true, dtype=bool)
    bins = []
    for low, high in itertools.pairwise(RELIABILITY_EDGES):
        inside = (probability >= low) & ((probability < high) | (high == RELIABILITY_EDGES[-1]))
        inside &= probability <= high
        if inside.any():
            bins.append(ReliabilityBin(low, high, float(probability[inside].mean()), share(outcome[inside])))
    return bins


def class_statements(
    truths: Sequence[CaseTruth], verdicts: Sequence[CaseVerdict]
) -> tuple[list[float], list[bool]]:
    """Every stated probability of every class, and whether it was present."""
    stated, true = [], []
    for truth, verdict in zip(truths, verdicts, strict=True):
        for name, probability in verdict.probability.items():
            stated.append(probability)
            true.append(present(truth, name))
    return stated, true


def true_closure(truth: CaseTruth, verdict: CaseVerdict) -> float:
    """1 - sum (after - clean)^2 / sum (before - clean)^2 over the noise-free hold-out.

    NaN where the prediction is missing, of another length, or leaves nothing to close before.
    """
    before, after = verdict.before, verdict.after
    if before is None or after is None or not len(before) == len(after) == len(truth.holdout):
        return float("nan")
    left = float(np.sum((before - truth.holdout) ** 2))
    return 1 - float(np.sum((after - truth.holdout) ** 2)) / left if left > 0 else float("nan")


def base_held(truth: CaseTruth, verdict: CaseVerdict) -> dict[str, bool]:
    """For every base parameter of both, whether its 94 % interval holds the true value."""
    return {
        name: low <= truth.base[name] <= high
        for name, (low, high) in verdict.base.items()
        if name in truth.base
    }


def strength_bin(truth: CaseTruth) -> str:
    """The bin of the smallest gap (over sigma) that the case carries, "none" without one."""
    if not truth.gap_over_sigma:
        return "none"
    smallest = min(truth.gap_over_sigma)
    for low, high in itertools.pairwise(STRENGTH_EDGES):
        if low <= smallest < high:
            return f"{low:g} to {high:g}" if np.isfinite(high) else f"{low:g} or more"
    return "none"
