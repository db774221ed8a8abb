"""Free functions: chi-squared where nothing is left, found at their own block, base tangents not counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, drive_axis, hypothesis, white
from fitted import SAMPLES, with_residuals
from scipy.stats import chi2, kstest

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.free_functions import (
    FreeFunction,
    directions,
    free_functions,
    linear_splines,
    motions,
    responses_of_blocks,
    shapes_of_blocks,
    shapes_that_only_tell,
)
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.model.blocks import DeadZone

INPUTS = [command(SAMPLES, seed) for seed in range(2)]


def noise(seed: int) -> list[FloatArray]:
    return [white(SAMPLES, SIGMA, 1000 + 2 * seed + record) for record in range(2)]


def found(fit: Fit) -> dict[str, FreeFunction]:
    chain = fit.hypothesis.chain(fit.values)
    moved = motions(fit, INPUTS)
    shown = responses_of_blocks(moved, chain, shapes_that_only_tell(moved))
    functions = free_functions(shown, fit.residuals, fit.jacobians, Plain(SIGMA))
    return {function.block: function for function in functions}


@pytest.mark.slow
def test_white_noise_gives_chi_squared() -> None:
    """Twice the gain of 60 noise draws, every block."""
    fit = with_residuals(noise(0))
    gains: dict[str, list[float]] = {}
    for seed in range(60):
        for block, function in found(replace(fit, residuals=noise(seed))).items():
            gains.setdefault(block, []).append(float(chi2.sf(2 * function.gain, function.shapes)))
    assert len(gains) == 8
    for values in gains.values():
        assert kstest(values, "uniform").pvalue > 1e-3


def test_base_tangents_are_not_counted() -> None:
    """Residuals that re-estimating the base takes away leave every function as it was."""
    fit = with_residuals(noise(1))
    shift = np.linspace(-20, 20, fit.jacobians[0].shape[1]) * SIGMA / np.linalg.norm(fit.jacobians[0], axis=0)
    bent = replace(fit, residuals=[e + j @ shift for e, j in zip(fit.residuals, fit.jacobians, strict=True)])
    for block, function in found(fit).items():
        assert found(bent)[block].gain == pytest.approx(function.gain, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize(
    "block", ["input", "input in detail", "gain over time", "linear", "drive", "sensor", "sensor in detail"]
)
def test_a_shape_of_a_block_is_found_there(block: str) -> None:
    """Most at its own block; what is taken is its response less what the base could do, to 15 %."""
    fit = with_residuals(noise(2))
    chain = fit.hypothesis.chain(fit.values)
    moved = motions(fit, INPUTS)
    door, shapes = {**shapes_of_blocks(moved), **shapes_that_only_tell(moved)}[block]
    response = [chain.small_responses(door, np.ascontiguousarray(s[:, 1:2])) for s in shapes]
    if door != "output":
        response = [m.shown(r) for m, r in zip(moved, response, strict=True)]
    response = [r[:, 0] for r in response]
    stacked, tangents = np.concatenate(response), np.concatenate(fit.jacobians)
    kept = stacked - tangents @ np.linalg.lstsq(tangents, stacked, rcond=None)[0]
    factor = 3 * SIGMA / np.sqrt(np.mean(kept**2))
    added = [e + factor * r for e, r in zip(noise(2), response, strict=True)]
    functions = found(replace(fit, residuals=added))
    assert max(functions.values(), key=lambda f: f.gain / f.shapes if f.gain > 100 else 0).gain > 1000
    assert functions[block].gain == pytest.approx(max(f.gain for f in functions.values()), rel=0.02)
    assert functions[block].size == pytest.approx(3 * SIGMA, rel=0.15)


def test_nothing_of_a_function_shows_inside_the_dead_zone() -> None:
    """The axis at its own parameters with a bent command: what changed is what the function's response says,
    none of it where the encoder sees no motion."""
    axis = replace(drive_axis(), dead_zone=DeadZone(0.1))
    fit = with_residuals(noise(3), hypothesis(axis, INPUTS))
    moved = motions(fit, INPUTS)
    w, dead_zone = fit.hypothesis.motion(fit.values)
    for motion, position in zip(moved, w, strict=True):
        assert motion.seen is not None and 0.02 < 1 - motion.seen.mean() < 0.9
        shown = motion.shown(np.ones((SAMPLES, 2)))
        np.testing.assert_array_equal(shown[:, 1] > 0, np.abs(position) > dead_zone)
    bent = [u + 0.002 * np.abs(u) for u in INPUTS]
    clean = fit.hypothesis.simulate_signals(fit.values, bent)
    chain = fit.hypothesis.chain(fit.values)
    for motion, (_, y), before in zip(moved, clean, fit.simulated, strict=True):
        inside = np.abs(motion.command) < np.abs(motion.limited) + 1e-12
        added = np.where(inside, 0.002 * np.abs(motion.limited), 0.0)[:, None]
        told = motion.shown(chain.small_responses("command", added))[:, 0]
        assert np.sqrt(np.mean((told - (y - before)) ** 2)) < 0.1 * np.std(y - before)


def test_hats_sum_to_one() -> None:
    shapes = linear_splines([np.linspace(-1, 2, 50), np.linspace(0, 3, 70)])
    for columns in shapes:
        np.testing.assert_allclose(columns.sum(axis=1), 1)
    assert linear_splines([np.zeros(5)])[0].shape == (5, 0)


def test_directions_are_those_of_the_singular_value_decomposition() -> None:
    """That of a column twice is left out; signs of the vectors may differ."""
    rng = np.random.default_rng(5)
    columns = rng.normal(size=(80, 4)) * [1.0, 0.5, 3.0, 1e-3]
    columns, left = np.concatenate([columns, columns[:, :1]], axis=1), rng.normal(size=80)
    u, s, vt = np.linalg.svd(columns, full_matrices=False)
    amplitude, values, right = directions(columns, left)
    assert len(amplitude) == len(values) == len(right) == 4
    np.testing.assert_allclose(values, s[:4])
    np.testing.assert_allclose(amplitude @ right, (u.T @ left)[:4] @ vt[:4], atol=1e-9)


def test_shapes_without_columns_take_nothing() -> None:
    """A command of one value has no splines over it."""
    amplitude, s, vt = directions(np.zeros((50, 0)), np.ones(50))
    assert len(amplitude) == len(s) == len(vt) == 0
