"""What a plain rule would have chosen: Akaike's criterion on white residuals. A baseline, not the answer."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.noise.whitener import LOG_2PI
from bayes_hw.gap.search.attribute import Attribution


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
