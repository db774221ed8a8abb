"""Step 1: the linear block by subspace identification and output error; it is also the linear baseline.

The baseline is y = G (u + offset), the constant offset being what removing means and trends beforehand would
allow a linear model. Order, delay and integrator are chosen by the criterion of
`bayes_hw.identify.criterion` on the simulated-output residual, the same that later chooses those of the
whole cascade.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_fit import CascadeFit, evaluated, fit_cascade, solve_linear_part
from bayes_hw.identify.cascade_roots import poles_of, with_poles
from bayes_hw.identify.criterion import DECISIVE, dynamics_criterion
from bayes_hw.identify.experiment import Experiment, PoleSource
from bayes_hw.record import Record

Progress: TypeAlias = Callable[[str, int, int], None]
"""Called with a stage's name, how many of its parts are done, and of how many."""

MIN_ORDER = 2
SCAN_ORDER = 6
"""Order at which the delay is first looked for; enough for an integrator, a lag and two modes."""

COARSE_ORDER = 3
COARSE_DELAYS = (0, 2, 5, 12, 30)
"""Delays compared by output error, at COARSE_ORDER, with the one that increments of the output suggest:
where those are mostly noise, they mislead."""

MAX_DELAY_S = 0.5
MAX_DELAY_SAMPLES = 40
NEAR_INTEGRATOR = 0.999
"""Where an integrator's pole starts when it is set free."""

FORGETTING = 0.1


@dataclass(frozen=True)
class OrderCandidate:
    """One structure that was tried: `rms` is the output error in output units, `criterion` decides
    (smaller is better; only differences mean something)."""

    order: int
    delay_samples: int
    integrator: bool
    rms: float
    criterion: float


@dataclass(frozen=True, eq=False)
class LinearStage:
    """The chosen linear model, every candidate, and the delay at which later steps start."""

    fit: CascadeFit
    candidates: tuple[OrderCandidate, ...]
    scanned_delay: int


def identify_linear(
    experiment: Experiment, source: PoleSource, max_order: int, report: Progress
) -> LinearStage:
    """Fit linear models of order 2 to `max_order`, and neighbouring delays and no integrator at the best."""
    delay = _coarse_delay(experiment, source, min(SCAN_ORDER, max_order))
    fits: list[CascadeFit] = []
    orders = range(MIN_ORDER, max_order + 1)
    for done, order in enumerate(orders):
        report("linear block", done, len(orders) + 1)
        fits.append(_fit_linear(experiment, source, order, delay))
    best = choose(fits)
    fits += [
        _fit_linear(experiment, source, best.structure.order, other)
        for other in (delay - 1, delay + 1)
        if other >= 0
    ]
    best = choose(fits)
    released = without_integrator(experiment, best)
    fits.append(released)
    report("linear block", len(orders) + 1, len(orders) + 1)
    if integrator_rejected(experiment, best, released):
        best = released
    return LinearStage(best, tabulate(experiment, fits), delay)


def _coarse_delay(experiment: Experiment, source: PoleSource, order: int) -> int:
    """The best of the scanned delay and the coarse ones."""
    scanned = scan_delay(experiment, source, experiment.commands, order)
    delays = {scanned, *(d for d in COARSE_DELAYS if d <= longest_delay(experiment))}
    fits = [_fit_linear(experiment, source, COARSE_ORDER, delay) for delay in sorted(delays)]
    return choose(fits).structure.delay_samples


def longest_delay(experiment: Experiment) -> int:
    """The longest delay looked for, in samples."""
    return min(MAX_DELAY_SAMPLES, max(4, round(MAX_DELAY_S * experiment.sample_rate_hz)))


def scan_delay(experiment: Experiment, source: PoleSource, commands: Sequence[FloatArray], order: int) -> int:
    """The delay, in samples, whose linear model leaves the least error of the output's increments."""
    errors = []
    for delay in range(longest_delay(experiment) + 1):
        structure = Structure.of_order(order, delay, True)
        _, error = best_poles(experiment, structure, source, commands)
        errors.append(error)
    return int(np.argmin(errors))


def best_poles(
    experiment: Experiment, structure: Structure, source: PoleSource, commands: Sequence[FloatArray]
) -> tuple[CascadeValues, float]:
    """The subspace poles whose model leaves the least error of the output's increments, with that error.

    Residues are solved for; the structure's initial states are left out, as increments do not hold the
    position.
    """
    at_rest = replace(structure, free_start=False)
    found = [
        solve_linear_part(
            at_rest,
            with_poles(at_rest, poles),
            commands,
            experiment.outputs,
            experiment.moving,
            differenced=True,
        )
        for poles in source.candidates(structure.order - int(structure.integrator))
    ]
    return min(found, key=lambda item: item[1])


def score(fit: CascadeFit) -> float:
    """The criterion for dynamics of one fit."""
    return dynamics_criterion(fit.residuals, fit.structure.size(len(fit.residuals)))


def choose(fits: Iterable[CascadeFit]) -> CascadeFit:
    """The fit with the smallest criterion."""
    return min(fits, key=score)


def tabulate(experiment: Experiment, fits: Iterable[CascadeFit]) -> tuple[OrderCandidate, ...]:
    """The best fit of every order, delay and integrator as a row, in the order in which they were made."""
    best: dict[tuple[int, int, bool], CascadeFit] = {}
    for fit in fits:
        key = fit.structure.order, fit.structure.delay_samples, fit.structure.integrator
        best[key] = choose([best[key], fit]) if key in best else fit
    return tuple(
        OrderCandidate(
            fit.structure.order,
            fit.structure.delay_samples,
            fit.structure.integrator,
            fit.rms * experiment.output_scale,
            score(fit),
        )
        for fit in best.values()
    )


def without_integrator(experiment: Experiment, fit: CascadeFit) -> CascadeFit:
    """The same structure with its integrator's pole free inside the unit circle, refitted."""
    if not fit.structure.integrator:
        return fit
    return fit_cascade(*freed_integrator(fit.structure, fit.values), experiment.records)


def freed_integrator(structure: Structure, values: CascadeValues) -> tuple[Structure, CascadeValues]:
    """Both with the integrator's pole first among the real ones, a little inside the unit circle."""
    pole = np.array([[NEAR_INTEGRATOR], [values.integrator_residue]])
    real = np.concatenate([pole, values.real], axis=1)
    freed = replace(structure, integrator=False, real_poles=structure.real_poles + 1)
    return freed, replace(values, integrator_residue=0.0, real=real)


def integrator_rejected(experiment: Experiment, with_it: CascadeFit, without_it: CascadeFit) -> bool:
    """Whether the model without an integrator is decisively better and forgets within the records.

    The slowest pole must decay by 1 / e within FORGETTING of the longest record: a slower leak is what
    other effects look like to an integrating axis, and the records are too short to tell it from an
    integrator.
    """
    forgets = forgets_within(without_it.values, experiment.records)
    return forgets and score(without_it) < score(with_it) - DECISIVE


def forgets_within(values: CascadeValues, records: Sequence[Record]) -> bool:
    """Whether the slowest pole of a G without an integrator decays by 1 / e within FORGETTING of the longest
    record."""
    slowest = float(np.abs(poles_of(values, integrator=False)).max())
    longest = max(len(record) for record in records)
    return bool(slowest ** (FORGETTING * longest) < np.exp(-1))


def _fit_linear(experiment: Experiment, source: PoleSource, order: int, delay: int) -> CascadeFit:
    structure = Structure.of_order(order, delay, True)
    structure = replace(structure, input_offset=True, free_start=experiment.free_start)
    poles, _ = best_poles(experiment, structure, source, experiment.commands)
    everywhere = [record.measured_samples.astype(np.float64) for record in experiment.records]
    solved, _ = solve_linear_part(
        structure, poles, experiment.commands, experiment.outputs, everywhere, differenced=False
    )
    starts = [solved] if experiment.free_start else [solved, poles]
    first = min(starts, key=lambda values: evaluated(structure, values, experiment.records).sum_of_squares)
    return fit_cascade(structure, first, experiment.records)
