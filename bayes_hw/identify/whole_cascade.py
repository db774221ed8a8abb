"""Step 4: the whole cascade with its noise, every order grown from the one below.

Order, delay, integrator and static blocks are chosen by the exact likelihood of coloured noise (see
`bayes_hw.identify.structure_choice`), every candidate descended with everything free. What the evidence
cannot exclude then stays: slow real poles, and a free beginning of the impulse response.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.cascade_fit import CascadeFit
from bayes_hw.identify.criterion import DECISIVE
from bayes_hw.identify.experiment import Experiment
from bayes_hw.identify.growth.delay import (
    apparent_delay,
    at_better_delay,
    coarse_delay,
    safe_delay,
    too_long,
    with_longer_delay,
    with_shorter_delay,
)
from bayes_hw.identify.growth.onset import with_free_onset
from bayes_hw.identify.growth.search import (
    Grown,
    absorbed,
    grow,
    likeliest,
    smallest_cascade,
    with_smaller_ones,
)
from bayes_hw.identify.growth.slow_poles import with_one_integrator, with_slow_poles
from bayes_hw.identify.holes import PAST_DELAYS
from bayes_hw.identify.linear_output_error import (
    OrderCandidate,
    Progress,
    forgets_within,
    freed_integrator,
)
from bayes_hw.identify.long_records import at_full_rate, for_search, search_factor
from bayes_hw.identify.noise import MAX_ORDER as MAX_NOISE_ORDER
from bayes_hw.identify.noise import samples_worth_one
from bayes_hw.identify.structure_choice import choice_criterion, chosen
from bayes_hw.identify.structure_pool import Kept, StructurePool, pool_of

SMALL_ORDER = 4
"""Order at which the delay is first looked for."""

CARRIED = 1.5
"""Error under coloured noise over that on plain residuals from which the noise carries what the axis does."""

BLOCKS = ("lower", "upper", "dead_zone")


@dataclass(frozen=True, eq=False)
class JointStage:
    """The chosen cascade; every order and delay tried; for each block in BLOCKS how much the criterion
    rises without it (None where the records could not show it at all), and the error then; which real poles
    were kept although the criterion asks for none; by how much the rate was lowered for the search, how many
    samples it saw, and the weights of all structures there.
    """

    fit: CascadeFit
    candidates: tuple[OrderCandidate, ...]
    evidence: dict[str, float | None]
    rms_without: dict[str, float]
    kept: Kept
    search_factor: int
    searched_samples: int
    pool: StructurePool


def identify_jointly(whole: Experiment, linear: CascadeFit, max_order: int, report: Progress) -> JointStage:
    """Grow, choose and prune; `linear` is the baseline, whose dynamics are a candidate too.

    Long records are searched at a lower rate or in part, and then fitted as a whole.
    """
    factor = search_factor(whole)
    experiment = for_search(whole, factor)
    tried: list[Grown] = []
    parts = 2 * max_order + 4

    def told(begin: int) -> Callable[[int], None]:
        return lambda order: report("whole cascade", min(begin + order, parts - 3), parts)

    report("whole cascade", 0, parts)
    lower, upper = experiment.sides_commanded
    structure = Structure(
        0,
        integrator=True,
        real_poles=0,
        sections=0,
        lower=lower,
        upper=upper,
        dead_zone=True,
        free_start=experiment.free_start,
    )
    small = _small(experiment, structure, min(SMALL_ORDER, max_order), told(0))
    if experiment.free_start:
        begun = replace(structure, delay_samples=apparent_delay(experiment.records))
        small = likeliest([small, _small(experiment, begun, min(SMALL_ORDER, max_order), told(0))])
    wanted, done, grown_plain, past = [small.structure.delay_samples], set[int](), list[Grown](), -1
    while wanted:
        delay = wanted.pop()
        if experiment.free_start and delay > PAST_DELAYS * past:
            # So far outputs counted that commands before the records decide; nothing compares with them.
            past, tried, done, grown_plain = delay, [], set(), []
            whole = whole.without_past(factor * delay)
            experiment = for_search(whole, factor)
        done.add(delay)
        grown, hidden = _grown(
            experiment, replace(structure, delay_samples=delay), max_order, told(max_order)
        )
        grown_plain += hidden
        misfit = bool(grown_plain)
        found = chosen(grown, misfit)
        if too_long(found):
            wanted.append(safe_delay(found))
        else:
            smaller = [item for item in grown if item.structure.order < found.structure.order]
            sooner = chosen([found, *(with_shorter_delay(item) for item in smaller)], misfit)
            later = with_longer_delay(found)
            followed = [found, sooner, later, at_better_delay(found)]
            if chosen([*tried, *followed], misfit) in followed:
                wanted += [item.structure.delay_samples for item in followed]
            tried += followed
        tried += grown
        wanted = [delay for delay in wanted if delay not in done]
    if factor == 1:
        tried.append(_without_blocks(experiment, linear))
    best = chosen(tried, misfit)
    report("whole cascade", parts - 2, parts)
    released = _without_integrator(best)
    if released is not None:
        tried.append(released)
        best = released
    best, evidence, rms_without = _drop_blocks(_that_simulates(best, grown_plain))
    best = with_one_integrator(_simulating(best))
    tried.append(best)
    chosen_order, slow, onset = best.structure.order, 0, 0
    if best.structure.dead_zone:
        best = with_slow_poles(best, misfit)
        slow = best.structure.order - chosen_order
    if experiment is whole:
        best = with_free_onset(best)
        onset = best.structure.order - chosen_order - slow
    kept = Kept(slow, onset)
    judged = best if best.point.most_noise == MAX_NOISE_ORDER else best.under_noise(MAX_NOISE_ORDER)
    pool = pool_of(tried, judged, kept, factor)
    best = at_full_rate(best, whole, factor)
    report("whole cascade", parts, parts)
    return JointStage(
        cascade_fit(best),
        _tabulated(tried, experiment.output_scale, misfit),
        evidence,
        rms_without,
        kept,
        factor,
        experiment.samples,
        pool,
    )


def cascade_fit(item: Grown) -> CascadeFit:
    """The cascade and its residuals."""
    return CascadeFit(item.structure, item.values, item.point.residuals)


def _small(experiment: Experiment, structure: Structure, order: int, told: Callable[[int], None]) -> Grown:
    """A cascade of few poles at the delay that suits it."""
    start = smallest_cascade(experiment.records, structure, experiment.noise_level)
    pool = _every_order(start, order, told)
    found = coarse_delay(pool[max(pool)])
    if not absorbed(pool[max(pool)]):
        return found
    start = smallest_cascade(experiment.records, structure, experiment.noise_level, most_noise=0)
    pool = _every_order(start, order, told)
    plain = coarse_delay(pool[max(pool)].under_noise(0).descended())
    return likeliest([found, plain.under_noise(MAX_NOISE_ORDER).descended()])


def _every_order(start: Grown, largest_order: int, told: Callable[[int], None]) -> dict[int, Grown]:
    """Grown from `start`, and fitted from the larger ones too."""
    return with_smaller_ones(grow(start, largest_order, told))


def _grown(
    experiment: Experiment, structure: Structure, largest_order: int, told: Callable[[int], None]
) -> tuple[list[Grown], list[Grown]]:
    """Cascades of every order and, where the noise model hid a misfit, those grown on plain residuals, which
    are then among them.

    Plain residuals show what is slow and hide what is small beside it: the criterion's best of those goes on
    under coloured noise, which shows resonances, unless that carries what the axis does there too.
    """
    start = smallest_cascade(experiment.records, structure, experiment.noise_level)
    pool = list(_every_order(start, largest_order, told).values())
    if not absorbed(chosen(pool)):
        return pool, []
    start = smallest_cascade(experiment.records, structure, experiment.noise_level, most_noise=0)
    plain = list(_every_order(start, largest_order, told).values())
    pool += plain
    resumed = chosen(plain, True)
    if _simulating(resumed) is resumed:
        pool += _every_order(resumed, largest_order, told).values()
    return pool, plain


def _enough_to_simulate(items: Iterable[Grown]) -> Grown:
    """The smallest of `items`, as it is on plain residuals, that no other serves decisively better there.

    An axis forgets within a record how it began: one that does not fits by initial states that last as long
    as the record, and is left out unless all are so. The others are weighed by the information criterion of
    the likelihood that a model with misfit is sampled by, that of white noise to the power 1 / tau (Gao and
    Song 2010, doi 10.1198/jasa.2010.tm09414), tau the samples of the best fit that are worth one.
    """
    plain = sorted((item.on_plain_residuals for item in items), key=lambda item: item.structure.order)
    plain = [item for item in plain if forgets_within(item.values, item.response.records)] or plain
    best = min((item.point for item in plain), key=lambda point: point.rms)
    worth = best.samples / samples_worth_one(best.residuals)
    criteria = [
        2 * worth * np.log(item.point.rms)
        + item.structure.n_linear * np.log(worth)
        + 2 * len(item.response.records) * item.structure.order
        for item in plain
    ]
    near = min(criteria) + DECISIVE
    return next(item for item, criterion in zip(plain, criteria, strict=True) if criterion <= near)


def _without_blocks(experiment: Experiment, linear: CascadeFit) -> Grown:
    """The baseline as a cascade without limits, dead zone and offset."""
    structure = replace(linear.structure, input_offset=False)
    values = replace(linear.values, input_offset=0.0)
    return Grown.at(structure, values, experiment.records).descended()


def _without_integrator(item: Grown) -> Grown | None:
    """`item` with its integrator's pole set free, where that is decisively better and forgets; see
    `integrator_rejected`."""
    if not item.structure.integrator:
        return None
    freed, moved = freed_integrator(item.structure, item.values)
    found = Grown.at(freed, moved, item.response.records).descended()
    forgets = forgets_within(found.values, item.response.records)
    return found if forgets and found.criterion < item.criterion - DECISIVE else None


def _drop_blocks(full: Grown) -> tuple[Grown, dict[str, float | None], dict[str, float]]:
    """Leave out, one after the other, the block whose absence costs least, while it costs less than
    DECISIVE."""
    evidence: dict[str, float | None] = dict.fromkeys(BLOCKS)
    rms_without: dict[str, float] = {}
    current = full
    while True:
        present = [block for block in BLOCKS if getattr(current.structure, block)]
        if not present:
            return current, evidence, rms_without
        without = {block: _without(current, block) for block in present}
        for block, item in without.items():
            evidence[block] = item.criterion - current.criterion
            rms_without[block] = item.point.rms
        weakest = min(present, key=lambda block: evidence[block] or 0.0)
        if (evidence[weakest] or 0.0) > DECISIVE:
            return current, evidence, rms_without
        current = without[weakest]


def _simulating(item: Grown) -> Grown:
    """`item`, or the same cascade on plain residuals where coloured noise leaves CARRIED times their error.

    The noise then carries what the axis does, and the cascade simulates badly.
    """
    if not absorbed(item):
        return item
    plain = item.on_plain_residuals
    return plain if item.point.rms > CARRIED * plain.point.rms else item


def _that_simulates(item: Grown, grown_plain: list[Grown]) -> Grown:
    """`item` where it simulates; else the best of those grown on plain residuals where that does; else what
    of them is enough to simulate.

    An order that the likelihood of coloured noise asked for, while that carried what the axis does, says
    nothing of how the axis moves.
    """
    simulating = _simulating(item)
    if simulating is item or not grown_plain or not item.structure.integrator:
        return simulating
    best = chosen(grown_plain, True)
    return best if _simulating(best) is best else _enough_to_simulate(grown_plain)


def _without(item: Grown, block: str) -> Grown:
    values = {
        "lower": replace(item.values, lower=-np.inf),
        "upper": replace(item.values, upper=np.inf),
        "dead_zone": replace(item.values, half_width=0.0),
    }
    structure = replace(item.structure, **{block: False})
    return Grown.at(structure, values[block], item.response.records, item.point.most_noise).descended()


def _tabulated(items: Iterable[Grown], output_scale: float, misfit: bool) -> tuple[OrderCandidate, ...]:
    """The best of every order, delay and integrator as a row."""
    found: dict[tuple[int, int, bool], Grown] = {}
    for item in items:
        key = item.structure.order, item.structure.delay_samples, item.structure.integrator
        if key not in found or choice_criterion(item, misfit) < choice_criterion(found[key], misfit):
            found[key] = item
    return tuple(
        OrderCandidate(*key, item.point.rms * output_scale, choice_criterion(item, misfit))
        for key, item in found.items()
    )
