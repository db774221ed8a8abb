"""What was found on the beginnings of long records, fitted to all of their samples.

Effects and structure are sought on a bounded number of samples, since the search fits hundreds of
explanations; the fits that its answer rests on are then descended on every sample, which is linear in their
number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.tone import without_line
from bayes_hw.gap.joint.search.hidden_zone import clear_of_zone
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.record import Record

STEPS = 8
"""Of each descent: the samples seen have brought it near."""


def on_whole_records(found: JointAnswer, records: Sequence[Record]) -> JointAnswer:
    """`found` with its fits descended on `records`, of which it has seen the beginnings.

    Readings that are repeated, glitches or timed badly are found anew among all, and a motion of one
    frequency is taken out of all. What each label earned and what is left stay as they were found.
    """
    if found.clear_of_zone:
        records = clear_of_zone(found.fit, records) or records
    plain, tone = fitted_to(replace(found.base, taken=0), records, None), found.tone
    if tone is not None:
        tone = without_line(plain, tone.frequency_hz)
        plain, records = tone.without, tone.without.response.records
    weights = None
    if found.base.response.weights is not None:
        weights = read_faults(plain).weights
    base = plain if weights is None else fitted_to(found.base, records, weights)
    commanded = records if found.fallen is None else found.fallen.of(records)
    fit = base if found.fit is found.base else fitted_to(found.fit, commanded, weights)
    known = tuple(
        one if one.without is None else replace(one, without=fitted_to(one.without, records, weights))
        for one in found.known
    )
    return replace(found, base=base, fit=fit, known=known, tone=tone)


def fitted_to(fit: JointFit, records: Sequence[Record], weights: tuple[FloatArray, ...] | None) -> JointFit:
    """The same explanation of other records."""
    response = replace(fit.response, records=tuple(records), weights=weights)
    return fit.under(response).descended(STEPS)
