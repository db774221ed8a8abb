"""Step 4: output-error minimisation over the whole cascade, from several starts, orders and delays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_fit import CascadeFit, fit_cascade
from bayes_hw.identify.criterion import DECISIVE, autocorrelation_time, block_criterion
from bayes_hw.identify.experiment import Experiment, PoleSource, pole_source
from bayes_hw.identify.linear_output_error import (
    MIN_ORDER,
    OrderCandidate,
    Progress,
    best_poles,
    choose,
    integrator_rejected,
    longest_delay,
    tabulate,
    without_integrator,
)
from bayes_hw.identify.output_nonlinearity import at_half_width

DRAWS = 32
LIMIT_LOG_SD = 0.25
HALF_WIDTH_LOG_SD = 0.7
STARTS = 5
AGREEMENT = 0.05
"""Starts agree when their errors, after short descents, exceed the smallest by no more than this fraction."""

SHORT = 25
"""Evaluations given to every start; the best goes on."""

BLOCKS = ("lower", "upper", "dead_zone")


@dataclass(frozen=True, eq=False)
class JointStage:
    """The chosen cascade; every order and delay tried; for each block in BLOCKS how much the criterion
    rises without it (None where the records could not show it at all), and the error then; how many starts
    agreed.
    """

    fit: CascadeFit
    candidates: tuple[OrderCandidate, ...]
    evidence: dict[str, float | None]
    rms_without: dict[str, float]
    agreeing: int
    starts: int


def identify_jointly(
    experiment: Experiment,
    starts: Sequence[CascadeFit],
    sources: Sequence[PoleSource],
    max_order: int,
    rng: np.random.Generator,
    report: Progress,
) -> JointStage:
    """Minimise the output error from cascades of step 3; their structure says which blocks there are."""
    orders = range(MIN_ORDER, max_order + 1)
    parts = len(orders) + 3
    report("whole cascade", 0, parts)
    fits = _from_several_starts(experiment, starts, rng)
    first = min(fits, key=lambda fit: fit.sum_of_squares)
    agreeing = sum(fit.rms <= (1 + AGREEMENT) * first.rms for fit in fits)
    first = fit_cascade(first.structure, first.values, experiment.records)
    saturated = [np.clip(u, first.values.lower, first.values.upper) for u in experiment.commands]
    all_sources = (*sources, pole_source(experiment, saturated))
    tried = [first]
    for done, order in enumerate(orders, start=1):
        report("whole cascade", done, parts)
        tried.append(at_order(experiment, choose(tried), order, None, all_sources))
    tried += _other_delays(experiment, tried, all_sources)
    report("whole cascade", parts - 2, parts)
    best = choose(tried)
    if best.structure.integrator:
        released = without_integrator(experiment, best)
        tried.append(released)
        if integrator_rejected(experiment, best, released):
            best = released
    report("whole cascade", parts - 1, parts)
    best, evidence, rms_without = _drop_blocks(experiment, best)
    finished = lower_orders(experiment, best, tried)
    tried += [best, *finished]
    best = choose([best, *finished])
    report("whole cascade", parts, parts)
    return JointStage(best, tabulate(experiment, tried), evidence, rms_without, agreeing, len(fits))


def at_order(
    experiment: Experiment,
    known: CascadeFit,
    order: int,
    delay_samples: int | None,
    sources: Sequence[PoleSource],
) -> CascadeFit:
    """The cascade of another order or delay (None keeps it), started with the static blocks of `known`."""
    old = known.structure
    linear = Structure.of_order(
        order, old.delay_samples if delay_samples is None else delay_samples, old.integrator
    )
    structure = replace(
        linear,
        lower=old.lower,
        upper=old.upper,
        dead_zone=old.dead_zone,
        free_start=old.free_start,
    )
    commands = [np.clip(u, known.values.lower, known.values.upper) for u in experiment.commands]
    starts = []
    for source in sources:
        poles, _ = best_poles(experiment, structure, source, commands)
        values = replace(poles, lower=known.values.lower, upper=known.values.upper)
        starts.append(at_half_width(experiment, structure, values, known.values.half_width))
    best = min(starts, key=lambda fit: fit.sum_of_squares)
    return fit_cascade(structure, best.values, experiment.records)


def lower_orders(experiment: Experiment, fit: CascadeFit, tried: Sequence[CascadeFit]) -> list[CascadeFit]:
    """Descents of lower orders tried, gone on with where blocks that the records do not show are left out of
    `fit`; none where none is.

    While such blocks are free, directions are flat in which a descent creeps: it ends short of its minimum,
    and rounding then decides whether the lower order seems good enough.
    """
    blocks = {block: getattr(fit.structure, block) for block in BLOCKS}
    found = []
    for other in tried:
        structure = replace(other.structure, **blocks)
        dynamics = structure.delay_samples, structure.integrator
        alike = dynamics == (fit.structure.delay_samples, fit.structure.integrator)
        if structure == other.structure or not alike or structure.order >= fit.structure.order:
            continue
        values = replace(
            other.values,
            lower=other.values.lower if structure.lower else -np.inf,
            upper=other.values.upper if structure.upper else np.inf,
            half_width=other.values.half_width if structure.dead_zone else 0.0,
        )
        found.append(fit_cascade(structure, values, experiment.records))
    return found


def _from_several_starts(
    experiment: Experiment, starts: Sequence[CascadeFit], rng: np.random.Generator
) -> list[CascadeFit]:
    """Short descents from the starts, and from the best of random changes of the first."""
    structure = starts[0].structure
    drawn = [
        at_half_width(experiment, structure, values, values.half_width)
        for values in (_jittered(starts[0].values, rng) for _ in range(DRAWS))
    ]
    drawn.sort(key=lambda fit: fit.sum_of_squares)
    return [
        fit_cascade(structure, fit.values, experiment.records, max_evaluations=SHORT)
        for fit in [*starts, *drawn[: STARTS - len(starts)]]
    ]


def _jittered(values: CascadeValues, rng: np.random.Generator) -> CascadeValues:
    lower, upper, half_width = np.exp(
        np.array([LIMIT_LOG_SD, LIMIT_LOG_SD, HALF_WIDTH_LOG_SD]) * rng.standard_normal(3)
    )
    return replace(
        values,
        lower=values.lower * lower,
        upper=values.upper * upper,
        half_width=values.half_width * half_width,
    )


def _other_delays(
    experiment: Experiment, tried: Sequence[CascadeFit], sources: Sequence[PoleSource]
) -> list[CascadeFit]:
    """Walk the delay down and up from the best fit for as long as the criterion falls."""
    best = choose(tried)
    found: list[CascadeFit] = []
    for step in (-1, 1):
        delay = best.structure.delay_samples + step
        while 0 <= delay <= longest_delay(experiment):
            fit = at_order(experiment, best, best.structure.order, delay, sources)
            found.append(fit)
            if choose([*tried, *found]) is not fit:
                break
            delay += step
    return found


def _drop_blocks(
    experiment: Experiment, full: CascadeFit
) -> tuple[CascadeFit, dict[str, float | None], dict[str, float]]:
    """Leave out, one after the other, the block whose absence costs least, while it costs less than
    DECISIVE."""
    evidence: dict[str, float | None] = dict.fromkeys(BLOCKS)
    rms_without: dict[str, float] = {}
    current = full
    while True:
        present = [block for block in BLOCKS if getattr(current.structure, block)]
        if not present:
            return current, evidence, rms_without
        time = autocorrelation_time(current.residuals)
        score = _block_score(current, time)
        without = {block: _without(experiment, current, block) for block in present}
        for block, fit in without.items():
            evidence[block] = _block_score(fit, time) - score
            rms_without[block] = fit.rms
        weakest = min(present, key=lambda block: evidence[block] or 0.0)
        if (evidence[weakest] or 0.0) > DECISIVE:
            return current, evidence, rms_without
        current = without[weakest]


def _block_score(fit: CascadeFit, time: float) -> float:
    return block_criterion(fit.residuals, fit.structure.size(len(fit.residuals)), time)


def _without(experiment: Experiment, fit: CascadeFit, block: str) -> CascadeFit:
    values, structure = fit.values, fit.structure
    if block == "lower":
        values, structure = replace(values, lower=-np.inf), replace(structure, lower=False)
    elif block == "upper":
        values, structure = replace(values, upper=np.inf), replace(structure, upper=False)
    else:
        values, structure = replace(values, half_width=0.0), replace(structure, dead_zone=False)
    return fit_cascade(structure, values, experiment.records)


def unless_linear_is_better(experiment: Experiment, joint: JointStage, linear: CascadeFit) -> JointStage:
    """`joint`, or a purely linear cascade refitted from the baseline `linear` where that errs no more.

    The cascade contains every linear model without a command offset, so a larger error than theirs is a local
    minimum, and the blocks found in it are not shown.
    """
    structure = replace(linear.structure, input_offset=False)
    plain = fit_cascade(structure, replace(linear.values, input_offset=0.0), experiment.records)
    if plain.sum_of_squares > joint.fit.sum_of_squares:
        return joint
    time = autocorrelation_time(plain.residuals)
    rise = _block_score(plain, time) - _block_score(joint.fit, time)
    present = [block for block in BLOCKS if getattr(joint.fit.structure, block)]
    return replace(
        joint,
        fit=plain,
        evidence=joint.evidence | dict.fromkeys(present, rise),
        rms_without=joint.rms_without | dict.fromkeys(present, plain.rms),
    )
