"""Scans over periods: every reduction is that of least squares on the projected waves themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, simulated_with
from own_simulators import AXIS_RATE, rigid_axis, sweep
from own_simulators import record as named_record

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import EncoderEccentricity, TorqueRipple
from bayes_hw.gap.effects.effect import PeriodicEffect
from bayes_hw.gap.effects.input import SaturationDrift
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.state_noise import walking_noise
from bayes_hw.gap.noise.whitener import Plain, Whitener
from bayes_hw.gap.search.period_scan import CHUNK, PeriodScan, scan_periods
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder, simulator_scale

INPUTS = [command(500, seed) for seed in (21, 22)]
FREQUENCIES = np.linspace(0.5, 6.0, CHUNK + 5)


@pytest.fixture(scope="module")
def base() -> Fit:
    """The base model fitted to records with a ripple that it lacks."""
    clean = simulated_with(TorqueRipple(), (30.0, 15.0, 0.3), INPUTS)
    measured = [y + white(500, SIGMA, 70 + i) for i, y in enumerate(clean)]
    found = hypothesis(AXIS, INPUTS)
    return fit(found, measured, found.prior_means, Plain(SIGMA), free=np.arange(8) < 4)


def wave(effect: PeriodicEffect, frequency: float, w: FloatArray) -> FloatArray:
    """Sine and cosine of the position (samples, 2): before the encoder their mean from every sample to the
    next, here that of a hundred places on the way."""
    share = np.array([0.0]) if effect.door == "output" else (np.arange(100) + 0.5) / 100
    angle = 2 * np.pi * frequency * (w[:, None] + share * np.diff(w, append=w[-1])[:, None])
    return np.stack([np.sin(angle).mean(axis=1), np.cos(angle).mean(axis=1)], axis=1)


def waves(
    base: Fit, effect: PeriodicEffect, frequency: float, positions: Sequence[FloatArray] | None = None
) -> list[FloatArray]:
    """Answers of y to a sine and a cosine of the position, one frequency at a time, (samples, 2) a record."""
    chain = base.hypothesis.chain(base.values)
    dead_zone = base.hypothesis.settings(base.values, chain)[S.DEAD_ZONE]
    answers = []
    for record, (w, _) in enumerate(base.hypothesis.simulate_signals(base.values)):
        u, at = INPUTS[record], w if positions is None else positions[record]
        added = wave(effect, frequency, at)
        if effect.door != "command":
            start = 2 * np.pi * frequency * at[0]
            added -= [np.sin(start), np.cos(start)]
        if effect.only_saturated:
            delayed = np.concatenate([np.zeros(chain.delay_samples), u])[: len(u)]
            lower, upper = base.values[:2]
            added *= np.select([delayed < lower, delayed > upper], [lower, upper], 0.0)[:, None]
        shift = chain.small_responses(effect.door, added)
        shift[np.abs(w) <= dead_zone] = 0.0
        answers.append(shift)
    return answers


@pytest.mark.parametrize(
    "whitener", [Plain(SIGMA), walking_noise(SIGMA, 0.3, 0.2 * SIGMA)], ids=["white", "walk"]
)
@pytest.mark.parametrize(
    "effect", [TorqueRipple(), EncoderEccentricity(), SaturationDrift()], ids=lambda effect: effect.name
)
def test_it_is_least_squares_on_the_projected_waves(
    base: Fit, effect: PeriodicEffect, whitener: Whitener
) -> None:
    """Across the bounds of chunks, for every door and a noise of any kind."""
    screen = Screen(base, whitener)
    scan = scan_periods(base, whitener, screen.tangents, screen.residual, effect, FREQUENCIES)
    for i in (0, 7, CHUNK - 1, CHUNK, len(FREQUENCIES) - 1):
        columns = screen.project(waves(base, effect, FREQUENCIES[i]))
        solution, *_ = np.linalg.lstsq(columns, screen.residual, rcond=None)
        explained = float(np.sum((columns @ solution) ** 2))
        assert scan.reductions[i] == pytest.approx(explained, rel=1e-4, abs=1e-6)
        np.testing.assert_allclose(columns @ scan.amplitudes[:, i], columns @ solution, atol=1e-3)


def test_waves_can_be_at_positions_of_their_own(base: Fit) -> None:
    """The dead zone stays that of the simulated axis."""
    plain, effect = Plain(SIGMA), TorqueRipple()
    positions = [1.1 * w + 0.01 for w, _ in base.hypothesis.simulate_signals(base.values)]
    screen = Screen(base, plain, positions)
    scan = scan_periods(base, plain, screen.tangents, screen.residual, effect, FREQUENCIES, positions)
    columns = screen.project(waves(base, effect, FREQUENCIES[7], positions))
    solution, *_ = np.linalg.lstsq(columns, screen.residual, rcond=None)
    assert scan.reductions[7] == pytest.approx(float(np.sum((columns @ solution) ** 2)), rel=1e-4)


@pytest.mark.parametrize("effect", [TorqueRipple(), EncoderEccentricity()], ids=lambda effect: effect.name)
def test_waves_through_a_simulator_are_those_of_its_doors(effect: PeriodicEffect) -> None:
    """Of a user's axis in its loop: as the responses of its doors to the same waves, on the same residual."""
    inputs = [sweep(300, seed) for seed in (3, 4)]
    axis = rigid_axis()
    records = [named_record(str(i), u, u, AXIS_RATE) for i, u in enumerate(inputs)]
    found = Hypothesis(SimulatorBuilder(axis), simulator_scale(axis, records, 1e-3), inputs)
    values = found.to_values(found.prior_means)
    measured = [y + white(300, 1e-3, 9 + i) for i, y in enumerate(found.simulate(values))]
    base, plain = fit(found, measured, found.prior_means, Plain(1e-3)), Plain(1e-3)
    screen, frequencies = Screen(base, plain), np.linspace(2.0, 30.0, 5)
    scan = scan_periods(base, plain, screen.tangents, screen.residual, effect, frequencies)
    chain = found.chain(base.values)
    for i, frequency in enumerate(frequencies):
        responses = []
        for w in found.motion(base.values)[0]:
            start = 2 * np.pi * frequency * w[0]
            added = wave(effect, frequency, w) - [np.sin(start), np.cos(start)]
            responses.append(chain.small_responses(effect.door, added))
        columns = screen.project(responses)
        solution, *_ = np.linalg.lstsq(columns, screen.residual, rcond=None)
        explained = float(np.sum((columns @ solution) ** 2))
        assert scan.reductions[i] == pytest.approx(explained, rel=1e-2, abs=1e-6)


def test_peaks_are_local_maxima_the_largest_first() -> None:
    scan = PeriodScan(np.array([5.0, 1.0, 3.0, 2.0, 2.0, 7.0, 6.0, 9.0]), np.zeros((2, 8)))
    assert scan.peaks() == [7, 5, 0, 2]


def test_one_frequency_is_enough(base: Fit) -> None:
    screen = Screen(base, Plain(SIGMA))
    scan = scan_periods(base, Plain(SIGMA), screen.tangents, screen.residual, TorqueRipple(), FREQUENCIES[:1])
    assert scan.reductions.shape == (1,) and scan.peaks() == [0]
