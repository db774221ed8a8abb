"""posterior.json of a corrected model: the numbers of the axis with what it lacked in the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayes_hw.format_names import POSTERIOR
from bayes_hw.gap.answer.verdict import Estimate

if TYPE_CHECKING:
    from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis

METHOD = (
    "independent draws of a normal about the joint fit of axis, effect and noise, deviations widened; "
    "no chains, so that there is no r_hat"
)


def corrected_posterior(diagnosis: JointDiagnosis) -> dict[str, object]:
    """The content of posterior.json, in its schema."""
    posterior, verdict = diagnosis.posterior, diagnosis.verdict
    draws = {**posterior.base, **posterior.effects}
    count = len(posterior.coordinates)
    parameters = {
        name: _entry(e, float(np.median(draws[name])) if name in draws else e.mean, count)
        for name, e in {**verdict.base, **verdict.parameters}.items()
    }
    return {
        "schema": POSTERIOR,
        "parameters": parameters,
        "converged": True,
        "problems": [],
        "failed_tests": [],
        "method": METHOD,
        "effects": list(verdict.answer),
        "interval": "94 % highest-density interval",
        "seconds": verdict.seconds,
    }


def _entry(estimate: Estimate, median: float, count: int) -> dict[str, object]:
    return {
        **estimate.to_dict(),
        "median": median,
        "ess_bulk": float(count),
        "ess_tail": float(count),
        "r_hat": None,
        "mcse_mean": estimate.sd / float(np.sqrt(count)),
    }
