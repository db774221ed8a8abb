"""The four-step identification of a Hammerstein-Wiener axis from its records alone.

Section 3.2 of Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012: linear block; input
nonlinearity; output nonlinearity; iterative output-error minimisation over all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.cascade_fit import CascadeFit, evaluated, fit_cascade
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.identify.experiment import Experiment, PoleSource, pole_source, prepare
from bayes_hw.identify.feedback import feedback_test
from bayes_hw.identify.holes import with_holes
from bayes_hw.identify.identified_model import (
    baseline_model,
    blocks_shown,
    cascade_in_units,
    hammerstein_wiener_model,
    search_note,
    warnings_of,
)
from bayes_hw.identify.input_nonlinearity import (
    InputNonlinearity,
    OutputNonlinearity,
    at_half_width,
    estimate_input_nonlinearity,
    estimate_output_nonlinearity,
)
from bayes_hw.identify.linear_output_error import (
    SCAN_ORDER,
    LinearStage,
    Progress,
    best_poles,
    identify_linear,
)
from bayes_hw.identify.long_records import beginnings
from bayes_hw.identify.noise import estimate_noise
from bayes_hw.identify.output_error import whitened
from bayes_hw.identify.result import Identification, Rebuilt, RecordFit, Step
from bayes_hw.identify.validation import fit_percent
from bayes_hw.identify.whole_cascade import JointStage, identify_jointly
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

MAX_ORDER = 20
MAX_LINEAR_ORDER = 8
"""Of the linear baseline, which a subspace gives at once."""

SHORT = 25
"""Evaluations of the refinement in step 2."""

FIGURE_POINTS = 2000


@dataclass(frozen=True, eq=False)
class _Path:
    """What steps 2 to 4 found."""

    input_step: InputNonlinearity
    input_fit: CascadeFit
    output_step: OutputNonlinearity
    joint: JointStage


def identify(
    records: Sequence[Record],
    *,
    name: str = "axis",
    max_order: int = MAX_ORDER,
    free_start: bool = False,
    report: Progress | None = None,
) -> Identification:
    """Estimate saturation, linear block and dead zone, and a linear baseline, from `records` of one axis.

    No nominal model is needed. With `free_start` the initial position and the initial states of G are
    estimated for every record and model; otherwise every record starts at rest with w = 0. `max_order`
    bounds the number of poles looked for. `report` is called as the work goes on. Raises InputError when the
    records cannot be used.
    """
    with one_blas_thread():
        return _identify(records, name, max_order, free_start, report or _silent)


def _identify(
    records: Sequence[Record],
    name: str,
    max_order: int,
    free_start: bool,
    progress: Progress,
) -> Identification:
    experiment = prepare(records, free_start=free_start)
    begun = beginnings(experiment)
    source = pole_source(begun, begun.commands)
    linear = identify_linear(begun, source, min(max_order, MAX_LINEAR_ORDER), progress)
    path = _identify_blocks(experiment, begun, linear, source, max_order, progress)
    everywhere = evaluated(linear.fit.structure, linear.fit.values, experiment.records)
    return _result(experiment, begun, records, replace(linear, fit=everywhere), path, name)


def _identify_blocks(
    whole: Experiment,
    experiment: Experiment,
    linear: LinearStage,
    source: PoleSource,
    max_order: int,
    report: Progress,
) -> _Path:
    """Steps 2 and 3 on the beginnings of long records, step 4 on the `whole`."""
    at_rest = Structure.of_order(
        min(SCAN_ORDER, max_order), linear.scanned_delay, linear.fit.structure.integrator
    )
    poles, _ = best_poles(experiment, at_rest, source, experiment.commands)
    report("input nonlinearity", 0, 1)
    input_step = estimate_input_nonlinearity(experiment, at_rest, poles)
    lower, upper = experiment.sides_commanded
    structure = replace(
        at_rest,
        lower=lower,
        upper=upper,
        free_start=experiment.free_start,
    )
    values = replace(
        input_step.values,
        lower=input_step.lower if structure.lower else -np.inf,
        upper=input_step.upper if structure.upper else np.inf,
    )
    hinged = at_half_width(experiment, structure, values, 0.0)
    input_fit = fit_cascade(structure, hinged.values, experiment.records, max_evaluations=SHORT)
    report("input nonlinearity", 1, 1)
    report("output nonlinearity", 0, 1)
    trials = [
        estimate_output_nonlinearity(experiment, structure, item) for item in (values, input_fit.values)
    ]
    output_step = min(trials, key=lambda trial: trial.fit.sum_of_squares)
    report("output nonlinearity", 1, 1)
    joint = identify_jointly(whole, linear.fit, max_order, report)
    return _Path(input_step, input_fit, output_step, joint)


def _result(
    experiment: Experiment,
    begun: Experiment,
    records: Sequence[Record],
    linear: LinearStage,
    path: _Path,
    name: str,
) -> Identification:
    final = path.joint.fit
    noise = estimate_noise(final.residuals)
    feedback = feedback_test(
        [record.u[noise.order :] for record in experiment.records],
        [
            with_holes(whitened(e, noise.autoregression, record.measured), record.measured)[noise.order :]
            for record, e in zip(experiment.records, final.residuals, strict=True)
        ],
    )
    noise = replace(noise, sigma=noise.sigma * experiment.output_scale)
    shown = blocks_shown(experiment, path.joint, records[0].units)
    model = hammerstein_wiener_model(experiment, final, noise.sigma, name, records[0].units)
    curve = path.input_step
    return Identification(
        model=model,
        baseline=baseline_model(experiment, linear.fit),
        cascade=cascade_in_units(experiment, final),
        baseline_cascade=cascade_in_units(experiment, linear.fit),
        steps=_steps(experiment, begun, linear, path),
        input_curve=Rebuilt(curve.command * experiment.input_scale, curve.rebuilt * experiment.input_scale),
        output_cloud=_thinned(
            path.output_step.intermediate * experiment.output_scale,
            path.output_step.output * experiment.output_scale,
        ),
        orders=path.joint.candidates,
        linear_orders=linear.candidates,
        fits=tuple(
            RecordFit(
                record.name,
                fit_percent(record.y, record.y - e),
                fit_percent(record.y, record.y - e_linear),
            )
            for record, e, e_linear in zip(
                experiment.records, final.residuals, linear.fit.residuals, strict=True
            )
        ),
        blocks_shown=shown,
        noise=noise,
        residuals=tuple(e * experiment.output_scale for e in final.residuals),
        warnings=(
            *search_note(path.joint.search_factor, path.joint.searched_samples, experiment.samples),
            *warnings_of(experiment, path.joint, linear.fit, shown),
            *([feedback.sentence] if feedback.closed_loop else []),
        ),
        pool=path.joint.pool,
    )


def _steps(experiment: Experiment, begun: Experiment, linear: LinearStage, path: _Path) -> tuple[Step, ...]:
    final = path.joint.fit
    return (
        _step(
            experiment,
            "linear block",
            "subspace identification, refined by output error; order and delay by the criterion for dynamics",
            linear.fit,
        ),
        _step(
            begun,
            "input nonlinearity",
            "f(u) rebuilt on hinges through G, saturation fitted to it, then refined by output error",
            path.input_fit,
        ),
        _step(
            begun,
            "output nonlinearity",
            "y against w simulated with the saturation, half width by the output error",
            path.output_step.fit,
        ),
        _step(
            experiment,
            "whole cascade",
            "limits, half width, G and coloured noise fitted together, G grown pole by pole; order, delay "
            "and integrator chosen by that likelihood, blocks that the records do not show left out",
            final,
        ),
    )


def _step(experiment: Experiment, name: str, description: str, fit: CascadeFit) -> Step:
    values, structure = experiment.in_original_units(fit.values), fit.structure
    measured = np.concatenate(experiment.outputs)
    return Step(
        name,
        description,
        cost=fit.rms * experiment.output_scale,
        fit_percent=fit_percent(measured, measured - np.concatenate(fit.residuals)),
        linear=linear_block(structure, values),
        lower=values.lower if structure.lower else None,
        upper=values.upper if structure.upper else None,
        half_width=values.half_width if structure.dead_zone else None,
    )


def _thinned(abscissa: FloatArray, ordinate: FloatArray) -> Rebuilt:
    chosen = slice(None, None, max(1, len(abscissa) // FIGURE_POINTS))
    return Rebuilt(abscissa[chosen], ordinate[chosen])


def _silent(stage: str, done: int, total: int) -> None:
    """Report nothing."""
