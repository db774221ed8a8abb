"""Short periods: found where a first scan is too coarse, and told from what noise holds by chance."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy, simulated_with

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import EncoderEccentricity, TransportDelay
from bayes_hw.gap.effects.drive import LoadRipple
from bayes_hw.gap.effects.effect import PeriodicEffect
from bayes_hw.gap.fit.fit import evaluated, fit
from bayes_hw.gap.fit.joint_fits import JointFits
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.search.short_periods import most_of_a_short_period, short_periods
from bayes_hw.gap.simulate.parallel import Each

INPUTS = [command(700, 1), command(700, 2)]
PLAIN = Plain(SIGMA)
BASE = hypothesis(AXIS, INPUTS)
EFFECTS = (TransportDelay(), LoadRipple(), EncoderEccentricity())


@pytest.mark.parametrize(
    "effect, truth",
    [
        pytest.param(LoadRipple(), (1.5, 0.75, 0.06), marks=pytest.mark.slow),
        (EncoderEccentricity(), (0.008, 0.004, 0.045)),
    ],
    ids=["ripple that a plain fit misses", "eccentricity"],
)
def test_the_effect_of_a_short_period_comes_first(effect: PeriodicEffect, truth: tuple[float, ...]) -> None:
    measured = noisy(simulated_with(effect, truth, INPUTS))
    nominal = evaluated(BASE, measured, BASE.prior_means, PLAIN)
    base = fit(BASE, measured, BASE.prior_means, PLAIN)
    found = short_periods(nominal, base, EFFECTS, JointFits(measured, PLAIN, Each(1)))
    assert found[0].hypothesis.labels == (effect.label,)
    assert found[0].values[-3:] == pytest.approx(truth, rel=0.15)
    assert [f.cost for f in found] == sorted(f.cost for f in found)


@pytest.mark.parametrize("ripple, stands_out", [((0.0, 0.0, 0.06), False), ((0.3, 0.1, 0.06), True)])
def test_a_short_period_stands_out_of_noise(ripple: tuple[float, ...], stands_out: bool) -> None:
    measured = noisy(simulated_with(LoadRipple(), ripple, INPUTS))
    base = fit(BASE, measured, BASE.prior_means, PLAIN)
    most = most_of_a_short_period(Screen(base, PLAIN), EFFECTS, Each(1))
    assert (most > 40) == stands_out


def test_without_periodic_effects_nothing_is_promised() -> None:
    measured: list[FloatArray] = noisy(BASE.simulate(BASE.builder.axis.nominal))
    held = evaluated(BASE, measured, BASE.to_coordinates(BASE.builder.axis.nominal), PLAIN)
    assert most_of_a_short_period(Screen(held, PLAIN), (TransportDelay(),), Each(1)) == 0.0
    assert np.isfinite(held.cost)
