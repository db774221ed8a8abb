"""A second effect beside chaotic backlash is found, and chaotic backlash that slow noise had stood for."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.drive import DynamicBacklash
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.input import CommandBias, RateLimit
from bayes_hw.gap.effects.sensor import GainAsymmetry
from bayes_hw.gap.fit.explanation import CHAOS_MARGIN, Explanation, with_coloured_noise, with_stochastic
from bayes_hw.gap.fit.fit import evaluated, fit
from bayes_hw.gap.noise.slow_noise import wind
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.chaotic_search import ChaoticSearch
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(900, 1), command(900, 2)]
BASE = hypothesis(AXIS, INPUTS)
NOMINAL = BASE.builder.axis.nominal
EFFECTS: tuple[Effect, ...] = (DynamicBacklash(), RateLimit(), CommandBias(), GainAsymmetry())
HALF_GAP, RATE_LIMIT = 0.012, 1.2


def search_of(measured: list[FloatArray]) -> ChaoticSearch:
    each, plain = Each(1), Plain(SIGMA)
    stochastic = StochasticSearch(measured, frozenset(["wind", "sensor_drift"]), SIGMA, each)
    return ChaoticSearch(BASE, measured, EFFECTS, plain, stochastic, each)


def under_wind(
    measured: list[FloatArray], effects: tuple[Effect, ...], values: tuple[float, ...]
) -> Explanation:
    """Effects at `values` beside the nominal model, what they leave taken for wind."""
    found = hypothesis(AXIS, INPUTS, *effects)
    start = found.to_coordinates(np.concatenate([NOMINAL, values]))
    at = evaluated(found, measured, start, Plain(SIGMA))
    noise = wind(at)
    assert noise is not None
    return with_stochastic(noise, at)


@pytest.mark.slow
def test_a_second_effect_shows_beside_chaos() -> None:
    """Its label; its size as near as its starts lie together, since chaos hides what small changes do."""
    both = hypothesis(AXIS, INPUTS, DynamicBacklash(), RateLimit())
    measured = noisy(both.simulate(np.concatenate([NOMINAL, (HALF_GAP, RATE_LIMIT)])))
    alone = under_wind(measured, (DynamicBacklash(),), (HALF_GAP,))
    found = search_of(measured).partners(alone)
    best = max(found, key=lambda e: e.log_evidence)
    assert best.labels == ("backlash", "rate_limit") and best.chaotic_response
    assert best.log_evidence > alone.log_evidence + CHAOS_MARGIN
    starts = np.log([rate for (rate,) in RateLimit().starts(BASE.scale)])
    assert abs(np.log(best.fit.values[-1] / RATE_LIMIT)) < np.diff(starts).max()


def test_chaos_is_found_where_slow_noise_had_stood_for_it() -> None:
    """From the base model under wind, and beside another effect; never beside itself."""
    clean = hypothesis(AXIS, INPUTS, DynamicBacklash()).simulate(np.append(NOMINAL, HALF_GAP))
    measured = noisy(clean)
    base = under_wind(measured, (), ())
    biased = under_wind(measured, (CommandBias(),), (1e-5,))
    found = search_of(measured).beside([base, biased])
    assert {e.labels for e in found} == {("backlash",), ("backlash", "command_bias")}
    best = max(found, key=lambda e: e.log_evidence)
    assert best.log_evidence > base.log_evidence + CHAOS_MARGIN
    assert best.fit.values[BASE.base_count :].max() == pytest.approx(HALF_GAP, rel=0.3)


def test_nothing_to_go_on_from() -> None:
    """Without slow noise nothing stands for motion that is lost."""
    measured = noisy(BASE.simulate(NOMINAL))
    base = with_coloured_noise(fit(BASE, measured, BASE.prior_means, Plain(SIGMA)), measured)
    search = search_of(measured)
    assert search.partners(base) == [] and search.beside([base]) == []
