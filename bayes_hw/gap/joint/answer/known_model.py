"""An identified axis with the known inputs of its records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayes_hw.gap.joint.answer.corrected_model import model_of
from bayes_hw.gap.joint.answer.idle_poles import without_idle_poles
from bayes_hw.gap.joint.decision.known_verdict import WAYS, doubtful
from bayes_hw.gap.joint.fit.base_cascade import natural_scale
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior.reported_quantities import dominant_sections
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.known_input import columns_of, with_known_inputs
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.identify.noise import estimate_noise
from bayes_hw.identify.result import Identification, RecordFit
from bayes_hw.identify.validation import fit_percent
from bayes_hw.phrases import log_evidence
from bayes_hw.record import Record


def with_known(identification: Identification, records: Sequence[Record]) -> Identification:
    """`identification` with its model estimated again together with the columns that the records follow.

    The model's `known` holds them; `warnings` say of every column what was found. As it is where the records
    have no further column, or begin in motion.
    """
    columns = columns_of(records)
    if not columns:
        return identification
    structure = identification.cascade.structure
    if structure.free_start:
        said = f"known inputs ({', '.join(columns)}) are not used: the records do not begin at rest"
        return replace(identification, warnings=(*identification.warnings, said))
    values = replace(identification.cascade.values, input_offset=0.0)
    sigma = identification.noise.innovation_sigma
    scale = natural_scale(records, (values.lower, values.upper), values.integrator_residue, sigma)
    response = JointResponse(replace(structure, input_offset=False), (), records, scale)
    start = JointFit(response, evaluate(response, response.coordinates(JointValues(values))))
    fit, found = with_known_inputs(start.descended())
    said_of = [
        f"known input {one.column}: the angle follows it {WAYS[one.way]}, {log_evidence(one.nats)}"
        if one.accepted
        else f"known input {one.column} is left out: the records do not show that the angle follows it "
        f"(probability {doubtful(one.nats):.2g})"
        for one in found
    ]
    warnings = (*identification.warnings, *said_of)
    if not fit.known_count:
        return replace(identification, warnings=warnings)
    noise = estimate_noise(fit.point.residuals)
    simulated = [fit.response.simulate(fit.values, r.u, r.known).y for r in records]
    model = model_of(identification.model.name, records, fit, noise.sigma, dominant_sections(fit))
    return replace(
        identification,
        model=without_idle_poles(model, records, noise),
        noise=noise,
        residuals=fit.point.residuals,
        fits=tuple(
            RecordFit(old.record, fit_percent(r.y_or_nan, y), old.linear)
            for old, r, y in zip(identification.fits, records, simulated, strict=True)
        ),
        warnings=warnings,
    )
