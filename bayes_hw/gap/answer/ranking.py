"""What was tried, in order of evidence, and what each would close of the gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.answer.decide import best_of_sets
from bayes_hw.gap.criticism.left_out import LeftOut
from bayes_hw.gap.noise.whitener import LOG_2PI
from bayes_hw.gap.search.attribute import Attribution


@dataclass(frozen=True)
class Ranked:
    """One set of effects on the training records.

    `gain` is the log-evidence over the base model with coloured noise, None where the set was screened on
    plain residuals only; `rmse` what it leaves, output units; `closes` the share of the reducible squared
    error of the base model that it removes, None where a stochastic effect leaves the response as it is;
    `left_out` how it predicts blocks left out, None where it was not compared.
    """

    name: str
    labels: tuple[str, ...]
    gain: float | None
    rmse: float
    closes: float | None
    left_out: LeftOut | None = None


def ranking(
    attribution: Attribution, noise_sigma: float, left_out: Mapping[tuple[str, ...], LeftOut]
) -> list[Ranked]:
    """The best explanation of every set of labels, then labels that came less far, by the error left."""
    base = attribution.base
    reducible = base.fit.rmse**2 - noise_sigma**2

    def closes(rmse: float) -> float | None:
        return (base.fit.rmse**2 - rmse**2) / reducible if reducible > 0 else None

    best = best_of_sets(attribution)
    found = [
        Ranked(
            e.name,
            labels,
            e.log_evidence - base.log_evidence,
            e.fit.rmse,
            closes(e.fit.rmse) if e.fit.hypothesis.effects else None,
            left_out.get(labels),
        )
        for labels, e in sorted(best.items(), key=lambda item: -item[1].log_evidence)
    ]
    seen = set(best)
    for single in sorted(attribution.singles, key=lambda f: f.rmse):
        if single.hypothesis.labels not in seen:
            seen.add(single.hypothesis.labels)
            name = single.hypothesis.effects[-1].name
            found.append(Ranked(name, single.hypothesis.labels, None, single.rmse, closes(single.rmse)))
    return found


def white_choice(attribution: Attribution) -> tuple[str, ...]:
    """Labels of the least Akaike criterion (doi 10.1109/TAC.1974.1100705) with residuals taken for white.

    Among the base, the plain fits of single effects and the stochastic effects alone.
    """
    plain = [attribution.base.fit, *attribution.singles]
    samples = attribution.base.fit.readings
    found = [
        (samples * (np.log(f.rmse**2) + LOG_2PI + 1) + 2 * (len(f.coordinates) + 1), f.hypothesis.labels)
        for f in plain
    ]
    for explanation in attribution.explanations:
        stochastic = explanation.stochastic
        if stochastic is None or explanation.fit.hypothesis.effects:
            continue
        free = len(explanation.fit.coordinates) + explanation.fit.whitener.parameter_count
        criterion = -2 * stochastic.log_likelihood + 2 * (free + len(stochastic.parameters))
        found.append((criterion, explanation.labels))
    return min(found, key=lambda item: item[0])[1]
