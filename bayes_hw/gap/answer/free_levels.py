"""The records of a case counted from the levels that its explanation gives them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.identify.holes import with_holes


def counted_from_levels(case: Case | SimulatorCase, explanation: Explanation) -> Case | SimulatorCase:
    """Records whose level was estimated counted from where the explanation says: to train on by its fit, held
    out by its simulation, since their own beginnings are all that told it."""
    fit = explanation.fit
    train = tuple(
        record.counted_from(float(np.median((record.y - s - e)[record.measured_samples])))
        if record.has_free_level
        else record
        for record, s, e in zip(case.train, fit.simulated, fit.residuals, strict=True)
    )
    if not any(record.has_free_level for record in case.holdout):
        return replace(case, train=train)
    simulated = fit.hypothesis.simulate(fit.values, case.held_out_inputs)
    holdout = tuple(
        record.counted_from(float(np.nanmedian(with_holes(record.y - y[-len(record) :], record.measured))))
        if record.has_free_level
        else record
        for record, y in zip(case.holdout, simulated, strict=True)
    )
    return replace(case, train=train, holdout=holdout)
