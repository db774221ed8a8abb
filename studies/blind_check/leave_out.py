"""An effect struck from the catalogue while the data carry it: is it noticed, does putting it back help?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayes_hw.gap.blind.counts import Share, answer_name, named_right, share, true_closure
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict, Evidence
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.plant.case import BlindCase


@dataclass(frozen=True)
class LeftOut:
    """What became of the cases of one label without and with its entry.

    `other` counts answers `other` without the entry, `acceptable` those and answers that the verdict with the
    entry calls confusable with the label; `answers` are the answers without it, most frequent first;
    `block_stated` is the mean probability that the verdicts without it state for the block they name. The
    closures are medians of the true closed fraction of the hold-out (NaN without a prediction), `shown` that
    of the share of the missing response that the free residual without the entry shows (NaN where no answer
    was `other`).
    """

    label: str
    other: Share
    acceptable: Share
    block: Share
    block_stated: float
    named_with: Share
    closed_without: float
    closed_with: float
    shown: float
    answers: tuple[tuple[str, int], ...]


def left_out(label: str, complete: Evidence, struck: Evidence, shown: Sequence[float]) -> LeftOut:
    """Compare the verdicts on the same cases with the whole catalogue and with `label` struck from it.

    `shown` is the `shown_share` of every case that has one.
    """
    cases = [
        (truth, full, lacking)
        for truth, full, lacking in zip(complete.truths, complete.verdicts, struck.verdicts, strict=True)
        if truth.effects == (label,)
    ]
    return LeftOut(
        label=label,
        other=share(v.answer == ("other",) for _, _, v in cases),
        acceptable=share(acceptable(label, full, lacking) for _, full, lacking in cases),
        block=share(v.block == LABEL_BLOCKS[label] for _, _, v in cases),
        block_stated=float(np.mean([v.share.get(v.block, 0.0) for _, _, v in cases])),
        named_with=share(named_right(t, v) for t, v, _ in cases),
        closed_without=_median_closure([(t, v) for t, _, v in cases]),
        closed_with=_median_closure([(t, v) for t, v, _ in cases]),
        shown=_median(shown),
        answers=tuple(Counter(answer_name(v.answer) for _, _, v in cases).most_common()),
    )


def acceptable(label: str, full: CaseVerdict, lacking: CaseVerdict) -> bool:
    """Whether the answer without the entry is `other`, or a label stated to be confusable with it."""
    if lacking.answer == ("other",):
        return True
    return len(lacking.answer) == 1 and frozenset((label, *lacking.answer)) in full.confusable


def shown_share(case: BlindCase, free_residual: Path) -> float:
    """Share of what the base model lacks on the training records that free_residual.csv shows of it.

    One minus the squared error of its response over the squared response that is missing, free of noise.
    """
    table = np.genfromtxt(free_residual, delimiter=",", names=True)
    missing = np.concatenate([record.without_noise for record in case.train]) - table["before"]
    return 1 - float(np.sum((missing - table["response"]) ** 2) / np.sum(missing**2))


def _median_closure(cases: list[tuple[CaseTruth, CaseVerdict]]) -> float:
    return _median([true_closure(truth, verdict) for truth, verdict in cases])


def _median(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.median(known)) if known else float("nan")
