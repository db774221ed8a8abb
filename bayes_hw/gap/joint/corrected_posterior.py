"""posterior.json of a corrected model: the numbers of the axis with what it lacked in the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.format_names import POSTERIOR
from bayes_hw.gap.answer.verdict import Estimate
from bayes_hw.infer.convergence import r_hat_of_draws

if TYPE_CHECKING:
    from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis

METHOD = (
    "independent draws of a normal about the joint fit of axis, effect and noise, deviations widened; "
    "r_hat is that of quarters of the draws, one where a parameter has none of its own"
)


def corrected_posterior(diagnosis: JointDiagnosis) -> dict[str, object]:
    """The content of posterior.json, in its schema."""
    posterior, verdict = diagnosis.posterior, diagnosis.verdict
    draws = {**posterior.base, **posterior.effects}
    count = len(posterior.coordinates)
    parameters = {
        name: _entry(e, np.asarray(draws.get(name, [e.mean])), count)
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


def _entry(estimate: Estimate, draws: FloatArray, count: int) -> dict[str, object]:
    return {
        **estimate.to_dict(),
        "median": float(np.median(draws)),
        "ess_bulk": float(count),
        "ess_tail": float(count),
        "r_hat": r_hat_of_draws(draws),
        "mcse_mean": estimate.sd / float(np.sqrt(count)),
    }
