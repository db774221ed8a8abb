"""What a plain rule would have answered: the explanation of least AIC under white noise."""

from __future__ import annotations

from dataclasses import replace

from bayes_hw.gap.blind.evidence import CaseVerdict, Evidence
from bayes_hw.gap.effects.labels import LABEL_BLOCKS


def of_white_choice(evidence: Evidence) -> Evidence:
    """The same cases as a plain rule would have answered them (`white_choice` of their verdicts)."""
    plain = []
    for verdict in evidence.verdicts:
        labels = verdict.white_choice
        block = LABEL_BLOCKS.get(labels[0], "") if labels else "none"
        said = dict.fromkeys(labels or ("none",), 1.0)
        probability = {label: said.get(label, 0.0) for label in verdict.probability}
        plain.append(CaseVerdict(labels, probability, block, failed=verdict.failed))
    return replace(evidence, verdicts=tuple(plain))
