"""A lattice is found, and slow noise of rounded records told from rounding alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, coloured, white
from fitted import AXIS, SAMPLES, base, noise, of_records, outputs, walking, with_residuals
from test_slow_noise import gusts, seen

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.lattice import lattice_step
from bayes_hw.gap.fit.explanation import with_coloured_noise
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.noise.rounding import (
    RoundedDisplay,
    SecondRounding,
    of_lattice,
    quantization,
)
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.state_noise import View, walking_noise
from bayes_hw.gap.noise.stochastic_fit import StochasticFit
from bayes_hw.gap.noise.two_causes import both as beside
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_quantization(step: float) -> None:
    """The step to 1e-3 and nothing but rounding left; unlike an encoder that does not round."""
    found_base = base()
    sigma = 0.3 * step
    measured = [
        step * np.round((y + white(SAMPLES, sigma, i)) / step)
        for i, y in enumerate(found_base.simulate(found_base.builder.axis.nominal))
    ]
    assert lattice_step(measured) == pytest.approx(step, rel=1e-3)
    found = quantization(of_records(measured, found_base), sigma)
    assert found is not None and found.label == "encoder_quantization" and found.display is not None
    assert found.parameters["encoder_quantization.step"][0] == pytest.approx(step, rel=1e-3)
    plain = [y + white(SAMPLES, SIGMA, i) for i, y in enumerate(outputs())]
    assert lattice_step(plain) == 0
    assert quantization(of_records(plain, found_base), SIGMA) is None


def test_noise_before_the_rounding_may_be_coloured() -> None:
    """Its level and correlation; that of a rounding of white noise stays white, and slow noise explains no
    more than either."""
    found_base, step, sigma = base(), 0.02, 0.3 * 0.02
    plain = found_base.simulate(found_base.builder.axis.nominal)
    for correlation in (0.0, 0.85):
        before = [coloured(SAMPLES, sigma, correlation, i) for i in range(len(plain))]
        measured = [step * np.round((y + e) / step) for y, e in zip(plain, before, strict=True)]
        host = of_records(measured, found_base)
        found = quantization(host, sigma)
        assert found is not None and isinstance(found.display, RoundedDisplay)
        assert found.display.sigma == pytest.approx(sigma, rel=0.15)
        assert found.display.correlation == pytest.approx(correlation, abs=0.08)
        noise_of = found.display.likelihood(measured, found.whitener)
        at_start = noise_of([y[:, None] for y in plain], noise_of.start[None, :])[0]
        assert at_start == pytest.approx(found.log_likelihood, abs=1e-6)
        walk = beside(random_walk, SecondRounding.of)(host)
        assert walk is None or walk.log_likelihood < found.log_likelihood + 5


def test_a_lattice_has_no_point_likelier_than_certain() -> None:
    """Readings that stand still, under a filter that follows them: as densities they would be."""
    step = 0.02
    still = [np.zeros(400)]
    noise_of = walking_noise(0.01 * step, 0.0, 1e-4 * step)
    views = (View(np.ones(400), np.full(400, step**2 / 12)),)
    noise_of = replace(noise_of, views=views).fitted_to(still)
    lattice = noise_of.log_likelihood + of_lattice(still, step, noise_of) + 400 * np.log(step)
    assert noise_of.log_likelihood + 400 * np.log(step) > 10
    assert -10 < lattice <= 0


def test_a_lattice_finer_than_the_noise_is_no_quantization() -> None:
    step = 0.5 * SIGMA
    measured = [step * np.round((y + e) / step) for y, e in zip(outputs(), noise(), strict=True)]
    assert quantization(of_records(measured, base()), AXIS.noise_sigma) is None


def test_a_rounded_display_is_the_mean_of_rounded_noise() -> None:
    """The soft staircase against averages over the noise."""
    step, sigma = 0.01, 0.3 * 0.01
    found_base = base(300, 1)
    y = found_base.simulate(found_base.builder.axis.nominal)[0]
    measured = step * np.round((y + white(300, sigma, 1)) / step)
    found = quantization(of_records([measured], found_base), sigma)
    assert found is not None and found.display is not None
    draws = np.random.default_rng(2).normal(0, found.display.sigma, (4000, 1))  # type: ignore[attr-defined]
    expected = np.mean(step * np.round((y + draws) / step), axis=0)
    np.testing.assert_allclose(found.display.show(y, 0), expected, atol=0.05 * step)


STEP = 4 * SIGMA


def rounded(residuals: list[FloatArray]) -> Fit:
    found = base(len(residuals[0]), len(residuals))
    simulated = found.simulate(found.builder.axis.nominal)
    return of_records(
        [STEP * np.round((s + e) / STEP) for s, e in zip(simulated, residuals, strict=True)], found
    )


@pytest.mark.parametrize(
    ("slow", "both", "alone"),
    [
        (walking(), beside(random_walk, SecondRounding.of), random_walk),
        (seen(gusts(0.2, 0.8, 3.0)), beside(wind, SecondRounding.of), wind),
    ],
    ids=["walk", "wind"],
)
def test_the_slow_noise_is_that_before_rounding(
    slow: list[FloatArray],
    both: Callable[..., StochasticFit | None],
    alone: Callable[..., StochasticFit | None],
) -> None:
    """Its size to 15 %, and the step."""
    clean, found = alone(with_residuals(slow)), both(rounded(slow))
    assert clean is not None and found is not None
    assert found.labels == (clean.label, ROUNDING)
    size = "sensor_drift.step_sd" if clean.label == "sensor_drift" else "wind.sd"
    assert found.parameters[size][0] == pytest.approx(clean.parameters[size][0], rel=0.15)
    assert found.size == pytest.approx(clean.size, rel=0.05)
    assert found.parameters["encoder_quantization.step"][0] == pytest.approx(STEP, rel=1e-4)
    assert both(with_residuals(slow)) is None


@pytest.mark.parametrize(
    ("residuals", "labels"),
    [
        (walking(), ("encoder_quantization", "sensor_drift")),
        ([coloured(SAMPLES, SIGMA, 0.0, i) for i in range(2)], ("encoder_quantization",)),
    ],
    ids=["walking", "still"],
)
def test_the_search_tells_slow_noise_from_rounding_alone(
    residuals: list[FloatArray], labels: tuple[str, ...]
) -> None:
    fit = rounded(residuals)
    start = with_coloured_noise(fit, fit.measured, 0)
    search = StochasticSearch(fit.measured, frozenset({ROUNDING, "wind", "sensor_drift"}), SIGMA, Each(1))
    alone = search.beside(start, [], [])
    best = max([*alone, *search.two_at_once(start, alone)], key=lambda e: e.log_evidence)
    assert best.labels == labels and best.rounded
