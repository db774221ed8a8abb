"""Blocks of causes without a name: nothing in noise, each found where it enters, the least of the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, white
from fitted import SAMPLES, base, gusts, of_records, shown, simulated_with, with_residuals
from scipy.stats import kstest

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.judgement import Remains
from bayes_hw.gap.criticism.block_functions import (
    BLOCK_OF,
    FLOOR,
    FLOOR_OF_SCATTER,
    FLOOR_OF_TORQUE,
    block_negative_log_p,
    shapes_for_any_cause,
    with_floor,
)
from bayes_hw.gap.criticism.free_functions import motions, responses_of
from bayes_hw.gap.effects.catalogue import CommandBias, GainAsymmetry, TransportDelay
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.labels import BLOCKS
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.whitener import Plain

INPUTS = [command(SAMPLES, seed) for seed in range(2)]


def noise(seed: int = 0, walk: float = 0.0) -> list[FloatArray]:
    """White noise a record, with a random walk of this step a sample, in units of the noise."""
    rng = np.random.default_rng(900 + seed)
    steps = [np.cumsum(walk * SIGMA * rng.normal(size=SAMPLES)) for _ in range(2)]
    return [white(SAMPLES, SIGMA, 1000 + 2 * seed + record) + w for record, w in enumerate(steps)]


@pytest.mark.parametrize("walk", [0.0, pytest.param(0.3, marks=pytest.mark.slow)])
def test_noise_and_a_random_walk_surprise_no_block(walk: float) -> None:
    """The surprise of a block with one function is exponential, with and without a walk."""
    found_fit = with_residuals(noise())
    drawn = [
        block_negative_log_p(replace(found_fit, residuals=noise(seed, walk)), INPUTS) for seed in range(8)
    ]
    assert kstest([found["linear"] for found in drawn], "expon").pvalue > 1e-3
    assert max(max(found.values()) for found in drawn) < 12


@pytest.mark.parametrize("name", list(BLOCK_OF))
def test_a_cause_is_found_where_it_enters(name: str) -> None:
    """The shape of every function that shows most beside the base's own, of three times the noise beside a
    random walk."""
    fit = with_residuals(noise(1, 0.1))
    moved = motions(fit, INPUTS)
    chain = fit.hypothesis.chain(fit.values)
    door, shapes = shapes_for_any_cause(moved, chain, fit.hypothesis.scale)[name][0]
    assert len(shapes) == 2
    responses = np.concatenate(responses_of(moved, chain, door, shapes))
    tangents, _ = np.linalg.qr(np.concatenate(fit.jacobians))
    beside = np.linalg.norm(responses - tangents @ (tangents.T @ responses), axis=0)
    response = responses[:, np.argmax(beside)]
    response *= 3 * SIGMA / np.std(response)
    added = [e + r for e, r in zip(noise(1, 0.1), np.split(response, 2), strict=True)]
    found = block_negative_log_p(replace(fit, residuals=added), INPUTS)
    assert max(found, key=lambda block: found[block]) == BLOCK_OF[name], found


@pytest.mark.parametrize(
    ("effect", "values"),
    [(CommandBias(), (0.003,)), (TransportDelay(), (0.4,)), (GainAsymmetry(), (0.03,))],
    ids=lambda value: getattr(value, "label", ""),
)
def test_an_effect_without_a_name_is_found_in_its_block(effect: Effect, values: tuple[float, ...]) -> None:
    """Simulated in full, the base model as it was."""
    clean = simulated_with(effect, values, INPUTS)
    measured = [y + e for y, e in zip(clean, noise(2), strict=True)]
    fit = of_records(measured, base())
    found = block_negative_log_p(fit, INPUTS)
    assert max(found, key=lambda block: found[block]) == effect.block, found


@pytest.mark.parametrize("seed", range(2))
def test_a_constant_command_is_told_from_a_torque(seed: int) -> None:
    """Once the base has been re-estimated, as it always is. Beside the base as it was, a torque that wanders
    slowly takes all of it."""
    measured = [
        y + e for y, e in zip(simulated_with(CommandBias(), (0.02,), INPUTS), noise(2 + seed), strict=True)
    ]
    refitted = fit(base(), measured, base().prior_means, Plain(SIGMA))
    found = block_negative_log_p(refitted, INPUTS)
    assert max(found, key=lambda block: found[block]) == "input", found


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("corner", "torque_sd"), [(0.05, 4.0), (0.2, 3.0), (0.6, 3.0)])
def test_a_torque_that_wanders_is_a_disturbance(corner: float, torque_sd: float, seed: int) -> None:
    """Though a walk of the reading takes most of what a free torque would."""
    windy = [e + g for e, g in zip(noise(seed), shown(gusts(corner, 2.0, torque_sd, seed)), strict=True)]
    found = block_negative_log_p(with_residuals(windy), INPUTS)
    assert found["disturbance"] >= FLOOR_OF_TORQUE
    assert max(found, key=lambda block: found[block]) == "disturbance", found


def test_a_reading_that_wanders_is_no_torque() -> None:
    for seed in range(2):
        found = block_negative_log_p(with_residuals(noise(seed, 0.3)), INPUTS)
        assert found["disturbance"] < FLOOR


def test_what_nothing_takes_is_a_reading() -> None:
    """The more so where what is left is in single samples; but not against what a block takes."""
    nothing = dict.fromkeys(BLOCKS, 1.0)
    plain, scattered = (with_floor(nothing, scattered=given) for given in (False, True))
    assert plain == {**nothing, "sensor": FLOOR} and scattered == {**nothing, "sensor": FLOOR_OF_SCATTER}
    taken = {**nothing, "drive": 2 * FLOOR_OF_SCATTER, "sensor": FLOOR_OF_SCATTER + 1}
    assert with_floor(taken, scattered=True) == taken
    by_plain, by_scattered, by_taken = (
        Remains((), blocks=blocks).probability_of_blocks(Calibration.built_in().block_sharpness)
        for blocks in (plain, scattered, taken)
    )
    assert 0.5 < by_plain["sensor"] < by_scattered["sensor"]
    assert by_taken["drive"] > by_taken["sensor"]
