"""Blocks of causes without a name: nothing in noise, each found where it enters, the least of the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, white
from fitted import SAMPLES, base, of_records, simulated_with, with_residuals
from scipy.stats import kstest

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.block_functions import (
    BLOCK_OF,
    FLOOR,
    FLOOR_OF_SCATTER,
    block_surprises,
    shapes_for_any_cause,
    with_floor,
)
from bayes_hw.gap.calibration import Calibration
from bayes_hw.gap.effects.catalogue import CommandBias, GainAsymmetry, TransportDelay
from bayes_hw.gap.effects.effect import BLOCKS, Effect
from bayes_hw.gap.free_functions import motions
from bayes_hw.gap.judgement import Remains
from bayes_hw.gap.signals import door_responses

INPUTS = [command(SAMPLES, seed) for seed in range(2)]


def noise(seed: int = 0, walk: float = 0.0) -> list[FloatArray]:
    """White noise a record, with a random walk of this step a sample, in units of the noise."""
    rng = np.random.default_rng(900 + seed)
    steps = [np.cumsum(walk * SIGMA * rng.normal(size=SAMPLES)) for _ in range(2)]
    return [white(SAMPLES, SIGMA, 1000 + 2 * seed + record) + w for record, w in enumerate(steps)]


@pytest.mark.parametrize("walk", [0.0, 0.3])
def test_noise_and_a_random_walk_surprise_no_block(walk: float) -> None:
    """The surprise of a block with one function is exponential, with and without a walk."""
    fit = with_residuals(noise())
    drawn = [block_surprises(replace(fit, residuals=noise(seed, walk)), INPUTS) for seed in range(25)]
    assert kstest([found["linear"] for found in drawn], "expon").pvalue > 1e-3
    assert max(max(found.values()) for found in drawn) < 12


@pytest.mark.parametrize("name", list(BLOCK_OF))
def test_a_cause_is_found_where_it_enters(name: str) -> None:
    """A shape of every function, of three times the noise beside a random walk."""
    fit = with_residuals(noise(1, 0.1))
    moved = motions(fit, INPUTS)
    chain = fit.hypothesis.chain(fit.values)
    door, shapes = shapes_for_any_cause(moved, chain, fit.hypothesis.scale)[name][0]
    assert len(shapes) == 2
    column = shapes[0].shape[1] // 3
    responses = [door_responses(chain, door, np.ascontiguousarray(s[:, column : column + 1])) for s in shapes]
    if door != "output":
        responses = [m.shown(r) for m, r in zip(moved, responses, strict=True)]
    size = 3 * SIGMA / np.std(np.concatenate(responses))
    added = [e + size * r[:, 0] for e, r in zip(noise(1, 0.1), responses, strict=True)]
    found = block_surprises(replace(fit, residuals=added), INPUTS)
    assert max(found, key=lambda block: found[block]) == BLOCK_OF[name], found


@pytest.mark.parametrize(
    ("effect", "values"),
    [(CommandBias(), (0.02,)), (TransportDelay(), (0.4,)), (GainAsymmetry(), (0.03,))],
    ids=lambda value: getattr(value, "label", ""),
)
def test_an_effect_without_a_name_is_found_in_its_block(effect: Effect, values: tuple[float, ...]) -> None:
    """Simulated in full, the base model as it was."""
    clean = simulated_with(effect, values, INPUTS)
    measured = [y + e for y, e in zip(clean, noise(2), strict=True)]
    fit = of_records(measured, base())
    found = block_surprises(fit, INPUTS)
    assert max(found, key=lambda block: found[block]) == effect.block, found


def test_what_nothing_takes_is_a_reading() -> None:
    """The more so where what is left is in single samples; but not against what a block takes."""
    nothing = dict.fromkeys(BLOCKS, 1.0)
    plain, scattered = (with_floor(nothing, scattered=given) for given in (False, True))
    assert plain == {**nothing, "sensor": FLOOR} and scattered == {**nothing, "sensor": FLOOR_OF_SCATTER}
    taken = {**nothing, "drive": 2 * FLOOR_OF_SCATTER, "sensor": FLOOR_OF_SCATTER + 1}
    assert with_floor(taken, scattered=True) == taken
    by_plain, by_scattered, by_taken = (
        Remains((), blocks=blocks).probability_of_blocks(Calibration.built_in())
        for blocks in (plain, scattered, taken)
    )
    assert 0.5 < by_plain["sensor"] < by_scattered["sensor"]
    assert by_taken["drive"] > by_taken["sensor"]
