"""The strategies of a search, in their order: what each seeks, when it is wanted, what shows the need of it.

All share one interface: a strategy looks at what is found so far and adds to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bayes_hw.gap.fit.continuation import can_be_led, led, measured_positions
from bayes_hw.gap.fit.explanation import Explanation, is_far_ahead
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.joint_fits import MORE_ITERATIONS, cheapest_of_each
from bayes_hw.gap.search.candidate_models import (
    SLIGHT,
    close_to_the_best,
    hides,
    is_coloured,
    later,
    leaders,
    may_hide_a_cause,
    with_parts,
    worst_first,
    worth_refining,
)
from bayes_hw.gap.search.chaotic_search import ChaoticSearch
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.search.short_periods import SHORT_KEPT, most_of_a_short_period, short_periods
from bayes_hw.gap.search.state import Search
from bayes_hw.gap.search.trimmed_search import TrimmedSearch

SINGLES_KEPT = 6
TRIED_FROM_NOMINAL = 14
TRIED_WHERE_NOTHING_IS_LEFT = 3

ROUNDED_LATER = 3
"""Effects found after the first ones that are held against a rounding encoder too."""

HIDING = 2
NEAR = 100.0
"""Log-evidence within which a second stochastic effect is held against every effect too."""

REFINED = 4
"""Single effects that are tried in forms of more parameters."""

RESTARTED = 3
LEADERS = 2
"""Labels of which the best fit is begun again near where it ended, before a second effect is sought."""

FOLLOWED_BESIDE = 3
"""Labels whose best single fit rugged motion is followed beside."""


@dataclass(frozen=True)
class Strategy:
    """One way to seek explanations.

    `told` says what is sought, empty where it is part of what was told before; `wanted` whether it is worth
    its time; `shown_by` names the test whose case is lost without it, as MODULE::FUNCTION in tests/gap.
    """

    told: str
    wanted: Callable[[Search], bool]
    seek: Callable[[Search], None]
    shown_by: str


def seek_single_effects(search: Search) -> None:
    """Every effect alone, beside the base model: far fewer of them where the base model leaves nothing."""
    tried = TRIED_FROM_NOMINAL if search.structure else TRIED_WHERE_NOTHING_IS_LEFT
    search.singles = search.single_fits(search.bases[0], tried)
    search.add_single_effects(search.joint.explained(search.singles[:SINGLES_KEPT]))


def seek_random_causes(search: Search) -> None:
    """Random causes, one or two at once, beside the base model and the best effects."""
    go_on = search.stochastic.lattice or search.unfinished
    search.first_hosts = list(search.coloured) if go_on else []
    base = search.base_alone
    noisy = search.stochastic.beside(base, search.first_hosts, search.singles if search.first_hosts else [])
    search.found += noisy + search.stochastic.two_at_once(base, noisy)


def noise_hides_a_period(search: Search) -> bool:
    """Whether slow noise explains everything, and yet an effect of a short period stands out of it."""
    best = search.best
    noise = best.cause_of_noise
    if noise is None or not noise.drifts or search.unfinished:
        return False
    screen = Screen(best.fit, noise.whitener)
    return most_of_a_short_period(screen, search.effects, search.each) > 2 * SLIGHT


def seek_short_periods(search: Search) -> None:
    """Effects periodic in position, of periods down to what the samples can follow; once."""
    if search.short_periods_known:
        return
    search.short_periods_known = True
    search.tell("short periods")
    short = short_periods(search.nominal, search.bases[0], search.effects, search.joint)
    search.singles = cheapest_of_each([*search.singles, *short])
    search.add_single_effects(search.joint.explained(short[:SHORT_KEPT]))


def seek_richer_forms(search: Search) -> None:
    """The best single effects in forms of more parameters."""
    search.add_single_effects(search.richer(sorted(search.coloured, key=worst_first)[:REFINED]))


def refine_under_repeats(search: Search) -> None:
    """Where repeated samples explain nearly all, the best explanations in richer forms, and nothing more."""
    search.found += search.richer(worth_refining(search.found))


def follow_rugged_motion(search: Search) -> None:
    """A gap, or a spring that jumps, corrected by what is measured, and simulated freely from there."""
    found = search.following.found([search.nominal, search.bases[0]], search.singles)
    search.found += found
    search.add_single_effects(search.joint.explained([search.following.set_free(e.fit) for e in found]))


def lead_the_ripple(search: Search) -> None:
    """From the measured position to the simulated one, where the best single effect is a ripple."""
    if not search.coloured:
        return
    best = min(search.coloured, key=worst_first).fit
    if can_be_led(best.hypothesis):
        positions = measured_positions(best)
        found = led(best.hypothesis, best.coordinates, positions, search.measured, search.plain)
        search.add_single_effects(search.joint.explained([found]))


def seek_on_stretches(search: Search) -> None:
    """Effects and pairs by least trimmed squares."""
    trimmed = TrimmedSearch(search.nominal, search.measured, search.effects, search.plain, search.each)
    search.found += trimmed.run(search.forms_at_nominal)


def refine_the_best(search: Search) -> None:
    """The best explanations with their effects in forms of more parameters, and their parts."""
    best = [e for e in worth_refining(search.found) if not any(e is known for known in search.refined)]
    search.refined += best
    richer = search.richer(best)
    search.found += richer + search.pairs.parts(sorted(richer, key=worst_first)[:1])


def seek_other_starts(search: Search) -> None:
    """Of single effects."""
    seek_short_periods(search)
    search.tell("other starts")
    leading = [e.fit for e in sorted(search.coloured, key=worst_first)][:RESTARTED]
    more = search.joint.explained(cheapest_of_each(search.multistart.elsewhere(leading)))
    more += search.near(leaders([*search.coloured, *more])[:LEADERS])
    search.add_single_effects(more)


def seek_pairs(search: Search) -> None:
    """Two effects at once, and effects under the random causes that may hide them."""
    firsts = [e.fit for e in sorted(search.coloured, key=worst_first)]
    search.found += _under_noise(search) + search.pairs.first(firsts, search.singles)
    if may_hide_a_cause(search.found):
        _seek_partners(search, firsts)
    if search.unfinished:
        refine_the_best(search)
    if search.unfinished:
        known = [e for e in search.found if e.stochastic is None and len(e.fit.hypothesis.effects) == 2]
        for pair in sorted(known, key=worst_first)[:1]:
            search.found += search.multistart.near(pair)


def _under_noise(search: Search) -> list[Explanation]:
    """Effects fitted under the best stochastic effects, which may hide them."""
    alone: dict[tuple[str, ...], Explanation] = {}
    for e in sorted(search.found, key=worst_first):
        if e.stochastic is not None and not e.fit.hypothesis.effects:
            alone.setdefault(e.labels, e)
    near = [e for e in alone.values() if e.log_evidence > max(x.log_evidence for x in alone.values()) - NEAR]
    return [pair for e in near[:HIDING] for pair in search.stochastic.under(e, search.effects)]


def _seek_partners(search: Search, tried: list[Fit]) -> None:
    """Pairs of the best single effect and of the best beside slow noise, which may stand for a second
    effect, where they are not among `tried`."""
    alone = [e for e in sorted(search.found, key=worst_first) if len(e.fit.hypothesis.effects) == 1]
    best = [next((e.fit for e in alone if kind(e)), None) for kind in (hides, is_coloured)]
    new = [f for f in best if f is not None and not any(f is host for host in tried)]
    search.found += [pair for f in new for pair in search.pairs.beside(f, search.singles)]


def seek_chaos(search: Search) -> None:
    """Second effects beside motion that is lost in chaos, or chaos beside what is best otherwise."""
    chaotic = ChaoticSearch(
        search.base, search.measured, search.effects, search.plain, search.stochastic, search.each
    )
    if not search.best.chaotic_response:
        search.found += chaotic.beside(search.found)
    best = search.best
    if not best.chaotic_response:
        return
    if best.followed is not None:
        search.found += search.following.partners(best)
    else:
        search.found += chaotic.partners(best)
    hosts = leaders([e for e in search.coloured if not e.chaotic])[:FOLLOWED_BESIDE]
    search.found += search.following.beside([host.fit for host in hosts])


def finish_the_best(search: Search) -> None:
    """The best explanation and its parts from near where they ended, and chaos under slow noise. Of several
    effects each is begun where they were found together too: a pair explains nothing that one of it does."""
    search.found += apart(search, search.best)
    together = [e for e in close_to_the_best(search.found).values() if len(e.fit.hypothesis.effects) > 1]
    search.found += search.pairs.parts(together)
    search.found += search.near(with_parts(search.found))
    for chaotic in [
        e for e in with_parts(search.found) if e.chaotic and e.stochastic is None and e.followed is None
    ]:
        noisy = search.stochastic.beside(chaotic, [], [])
        search.found += noisy + search.stochastic.two_at_once(chaotic, noisy)


def apart(search: Search, best: Explanation) -> list[Explanation]:
    """The response of `best` without its noise and the noise without the response, both from where they
    were found together: either can have led the fit to where it needs the other no more."""
    found, noise = best.fit, best.stochastic
    if not found.hypothesis.effects or noise is None or best.display is not None:
        return []
    plain = fit(found.hypothesis, search.measured, found.coordinates, search.plain, MORE_ITERATIONS)
    alone = search.stochastic.moved(best, search.base, found.coordinates[: search.base.base_count])
    return [*search.joint.explained([plain]), alone]


def round_what_came_later(search: Search) -> None:
    """Effects found after the first ones beside a rounding encoder, which the records show there to be."""
    new = later(search.found, search.first_hosts)[:ROUNDED_LATER]
    search.found += search.stochastic.beside(search.base_alone, new, [])


def _always(search: Search) -> bool:  # noqa: ARG001
    return True


def _further(search: Search) -> bool:
    """Whether the base model left structure, and no repeated samples explain nearly all."""
    return search.structure and not search.repeats_explain and search.unfinished


def _further_and_predictable(search: Search) -> bool:
    return _further(search) and not is_far_ahead(search.found)


STRATEGIES: tuple[Strategy, ...] = (
    Strategy(
        "single effects",
        _always,
        seek_single_effects,
        "search/test_attribute.py::test_the_effect_that_is_there_is_the_best",
    ),
    Strategy(
        "stochastic effects",
        _always,
        seek_random_causes,
        "search/test_attribute.py::test_rounding_is_held_against_the_response_beside_it",
    ),
    Strategy(
        "",
        noise_hides_a_period,
        seek_short_periods,
        "search/test_short_periods.py::test_a_short_period_stands_out_of_noise",
    ),
    Strategy(
        "forms of more parameters",
        lambda search: search.structure and search.goes_on,
        seek_richer_forms,
        "search/test_attribute.py::test_a_richer_form_does_not_pass_for_noise",
    ),
    Strategy(
        "",
        lambda search: search.repeats_explain and search.unfinished,
        refine_under_repeats,
        "search/test_attribute.py::test_a_display_that_explains_all_ends_the_search",
    ),
    Strategy(
        "rugged motion followed",
        _further,
        follow_rugged_motion,
        "search/test_following.py::test_a_spring_that_jumps_is_followed",
    ),
    Strategy(
        "",
        _further,
        lead_the_ripple,
        "fit/test_continuation.py::test_a_minimum_is_found_that_a_plain_fit_misses",
    ),
    Strategy(
        "pairs on the stretches that fit best",
        _further_and_predictable,
        seek_on_stretches,
        "search/test_trimmed_search.py::test_the_pair_is_found_beside_a_stretch_that_goes_its_own_way",
    ),
    Strategy(
        "",
        _further,
        refine_the_best,
        "search/test_refinement.py::test_a_ramp_is_found_behind_the_limiter_from_one_in_front_of_it",
    ),
    Strategy(
        "",
        _further,
        seek_other_starts,
        "search/test_multistart.py::test_near_an_unfinished_fit_a_better_one_is_found",
    ),
    Strategy(
        "pairs of effects",
        lambda search: (
            search.structure
            and not search.repeats_explain
            and not is_far_ahead(search.found)
            and search.goes_on
        ),
        seek_pairs,
        "search/test_pair_search.py::test_without_a_single_fit_the_pair_is_found_too",
    ),
    Strategy(
        "chaotic motion",
        _further,
        seek_chaos,
        "search/test_chaotic_search.py::test_chaos_is_found_where_slow_noise_had_stood_for_it",
    ),
    Strategy(
        "",
        _always,
        finish_the_best,
        "search/test_attribute.py::test_an_effect_of_no_size_is_not_ahead_of_the_noise_alone",
    ),
    Strategy(
        "",
        lambda search: search.stochastic.lattice,
        round_what_came_later,
        "search/test_attribute.py::test_rounding_is_held_against_the_response_beside_it",
    ),
)
"""In the order in which they are tried."""
