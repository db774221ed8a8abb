"""Structure, effects and noise inferred together: search, decision, and the posterior of the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.decision.given_decision import GivenCalibration, GivenEvidence, decide_given
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import JointDecision, decide_jointly, explaining, rivals_of
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.structure_moves import widened
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_search import search_given
from bayes_hw.gap.joint.posterior.given_posterior import INFLATION as GIVEN_INFLATION
from bayes_hw.gap.joint.posterior.given_posterior import laplace_given
from bayes_hw.gap.joint.posterior.joint_posterior import INFLATION, JointPosterior, averaged, laplace
from bayes_hw.gap.joint.posterior.reported_quantities import dominant_sections, sections_of_modes
from bayes_hw.gap.joint.residuals.remainder import leaves_a_cause
from bayes_hw.gap.joint.search.joint_search import JointAnswer, search
from bayes_hw.gap.joint.search.whole_records import fitted_to, on_whole_records
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record
from bayes_hw.time_budget import at_most

OF_SEARCH = 0.9
"""Of the time, that the search from records alone may take: the rest is for the numbers of what it found."""

OF_ROUNDED = 3.0
"""Factor on standard deviations where readings are rounded, held or late, so that errors are not independent,
where something without a name remains, an observer makes up for what a law lacks, or where the form of an
effect of a given model leaves noise that counts as a cause."""


@dataclass(frozen=True, eq=False)
class Inferred:
    """What a search found in `records`, what was decided on it, and the posterior of that answer, averaged
    over its rivals."""

    records: tuple[Record, ...]
    found: JointAnswer
    decision: JointDecision
    posterior: JointPosterior


def infer_alone(
    records: tuple[Record, ...],
    whole: tuple[Record, ...],
    within_s: float,
    say: Callable[[str], None],
    rng: np.random.Generator,
) -> Inferred:
    """From records alone; `whole` are those of which `records` may be the beginnings: numbers are of all.

    The middle of the posterior is the explanation that was chosen, which predicts better than a wider G; its
    draws are those about the wider one, which know what the choice left out.
    """
    with at_most(within_s):
        with at_most(OF_SEARCH * within_s):
            found = search(records, say)
        decision = decide_jointly(found)
        fit = explaining(found, decision)
        wider, extensions = widened(fit)
        if whole is not records:
            on_base = fit is found.base
            found = on_whole_records(found, whole)
            fit = found.base if on_base else found.fit
            wider = fitted_to(wider, whole, found.base.response.weights)
    sections = sections_of_modes(fit, dominant_sections(fit), wider)
    poorly = _poorly_described(decision) or fit.observer is not None
    inflation, units = OF_ROUNDED if poorly else INFLATION, records[0].units
    rivals = rivals_of(found, decision, JointCalibration.built_in())
    posterior = laplace(wider, units, rng, inflation, sections, poorly or bool(fit.labels))
    others = [(laplace(one, units, rng, inflation), share) for one, share in rivals]
    for extend in extensions:
        fit = extend(fit)
    posterior = replace(posterior, fit=fit, sections=tuple(sections_of_modes(wider, posterior.sections, fit)))
    return Inferred(whole, found, decision, averaged(posterior, others, rng))


def infer_around(
    model: HammersteinWiener,
    records: tuple[Record, ...],
    within_s: float,
    say: Callable[[str], None],
    rng: np.random.Generator,
) -> Inferred:
    """Around a model as it is given but for its base parameters."""
    with at_most(within_s):
        found = search_given(records, model, say)
    decision = decide_given(GivenEvidence.of(found, model.noise_sigma))
    poorly = _poorly_described(decision) or leaves_a_cause(found.fit)
    inflation, units = OF_ROUNDED if poorly else GIVEN_INFLATION, records[0].units
    rivals = rivals_of(found, decision, GivenCalibration.built_in())
    posterior = laplace_given(_as_given(explaining(found, decision)), units, rng, inflation)
    others = [(laplace_given(_as_given(one), units, rng, inflation), share) for one, share in rivals]
    return Inferred(records, found, decision, averaged(posterior, others, rng))


def _as_given(fit: JointFit) -> GivenFit:
    assert isinstance(fit, GivenFit)
    return fit


def _poorly_described(decision: JointDecision) -> bool:
    """Whether the noise of the answer is less than well described by a normal one, or something without a
    name is in it."""
    return bool(set(decision.answer) & {"encoder_quantization", "timing_jitter", OTHER})
