"""Truths and verdicts made by hand."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.blind.counts import CLASSES
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict


def truth(*effects: str, gap: float = 2.0, name: str = "case", holdout: object = (0.0, 0.0)) -> CaseTruth:
    """A case that carries these effects."""
    base = {"gain": 1.0, "noise.sigma": 0.1}
    return CaseTruth(
        name, effects, effects, (gap,) * len(effects), base, 0.0, np.asarray(holdout, dtype=float)
    )


def verdict(*answer: str, sure: float = 1.0, block: str = "", **fields: object) -> CaseVerdict:
    """An answer with this probability, all other classes at zero."""
    said = answer or ("none",)
    probability = {name: (sure if name in said else 0.0) for name in CLASSES}
    return CaseVerdict(answer, probability, block, **fields)  # type: ignore[arg-type]
