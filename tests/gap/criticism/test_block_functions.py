"""Blocks of causes without a name: nothing in noise, each found where it enters, the least of the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import MOTOR_ANGLE, RATE, SIGMA, TRAIN, V, W, command, held, white
from fitted import AXIS, SAMPLES, base, gusts, of_records, shown, simulated_with, with_residuals
from scipy.ndimage import binary_erosion
from scipy.stats import kstest

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.judgement import Remains
from bayes_hw.gap.criticism.block_functions import (
    AGES_S,
    AMPLITUDES,
    BLOCK_OF,
    FLOOR,
    FLOOR_OF_SCATTER,
    FLOOR_OF_TORQUE,
    block_negative_log_p,
    motions_of_the_motor,
    shapes_for_any_cause,
    shapes_of_friction,
    shapes_of_memories,
    shapes_of_springs,
    with_floor,
)
from bayes_hw.gap.criticism.free_functions import Motion, motions, responses_of
from bayes_hw.gap.effects.catalogue import CommandBias, CubicStiffness, GainAsymmetry, TransportDelay
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.labels import BLOCKS
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

INPUTS = [command(SAMPLES, seed) for seed in range(2)]


def noise(seed: int = 0, walk: float = 0.0) -> list[FloatArray]:
    """White noise a record, with a random walk of this step a sample, in units of the noise."""
    rng = np.random.default_rng(900 + seed)
    steps = [np.cumsum(walk * SIGMA * rng.normal(size=SAMPLES)) for _ in range(2)]
    return [white(SAMPLES, SIGMA, 1000 + 2 * seed + record) + w for record, w in enumerate(steps)]


@pytest.mark.slow
@pytest.mark.parametrize("walk", [0.0, 0.3])
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


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
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


CHAIN = ChainBuilder(AXIS).chain(ChainBuilder(AXIS).axis.nominal)


def angle_of_the_motor(limited: FloatArray) -> FloatArray:
    """By the state space of the drive train under the same held commands."""
    a, b, c = TRAIN.state_space()
    ad, bd = held(a, b[:, [V]], 1 / RATE)
    angle, x = np.empty(len(limited)), np.zeros(7)
    for k, u in enumerate(limited):
        angle[k] = c[MOTOR_ANGLE] @ x
        x = ad @ x + bd[:, 0] * u
    return angle


def test_the_motor_moves_as_in_state_space() -> None:
    """Its speed, where the encoder sees the motion of the load; that differs from the load's."""
    found = motions(with_residuals([np.zeros(SAMPLES)] * 2), INPUTS)
    for load, motor in zip(found, motions_of_the_motor(found, CHAIN, base().scale), strict=True):
        expected = np.gradient(angle_of_the_motor(load.limited)) * RATE
        seen = np.ones(SAMPLES, dtype=bool) if load.seen is None else binary_erosion(load.seen)
        assert np.mean(seen) > 0.7
        error = np.abs(motor.speed - expected)[seen]
        assert np.max(error) < 1e-2 * np.max(np.abs(expected))
        assert np.max(np.abs(load.speed - expected)[seen]) > 5 * np.max(error)


def test_friction_turns_with_the_speed() -> None:
    """Every shape changes its sign with the motion but for splines, which change places; no motion, no
    sign."""
    rng = np.random.default_rng(3)
    speed = np.repeat(rng.normal(size=40), 10)
    one = Motion(speed, speed, np.cumsum(speed), speed)
    there = shapes_of_friction([one], RATE)[0]
    back = shapes_of_friction([replace(one, speed=-speed)], RATE)[0]
    assert there.shape == back.shape and len(there) == len(speed)
    np.testing.assert_array_equal(there[:, 0], np.sign(speed))
    np.testing.assert_array_equal(back[:, 0], -there[:, 0])
    np.testing.assert_allclose(back[:, 1:8], there[:, 7:0:-1], atol=1e-12)
    np.testing.assert_allclose(back[:, 8:], -there[:, 8:], atol=1e-12)
    np.testing.assert_allclose(there[:, 1:8].sum(axis=1), 1.0)


def chain_of(model: HammersteinWiener = AXIS) -> Chain:
    builder = ChainBuilder(model)
    return builder.chain(builder.axis.nominal)


def test_torsion_is_motor_less_load() -> None:
    """That of the drive train in state space under the same held commands."""
    a, b, c = TRAIN.state_space()
    ad, bd = held(a, b[:, [V]], 1 / RATE)
    expected, x = np.empty(SAMPLES), np.zeros(7)
    for k, u in enumerate(INPUTS[0]):
        expected[k] = (c[MOTOR_ANGLE] - c[W]) @ x
        x = ad @ x + bd[:, 0] * u
    found = chain_of().torsions(INPUTS[0][:, None])[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_a_slightly_stiffer_spring_acts_by_its_torsion() -> None:
    """To first order its response is that of its own torque between motor and load."""
    cubic = 5.0
    plain, stiff = (simulated_with(CubicStiffness(), (value,), INPUTS)[0] for value in (0.0, cubic))
    chain, fit = chain_of(), with_residuals([np.zeros(SAMPLES)] * 2)
    limited = motions(fit, INPUTS)[0].limited
    torque = chain.stiffness[1] * cubic * chain.torsions(limited[:, None]) ** 3
    response = chain.small_responses("gear_torque", torque)[:, 0]
    np.testing.assert_allclose(response @ (stiff - plain), response @ response, rtol=0.05)


def test_stiffness_at_every_amplitude_adds_to_that_at_all() -> None:
    """Torsion and its rate, each shared among the amplitudes."""
    fit = with_residuals([np.zeros(SAMPLES)] * 2)
    moved, chain = motions(fit, INPUTS), chain_of()
    shapes = shapes_of_springs(moved, chain, fit.hypothesis.scale)
    for m, own in zip(moved, shapes, strict=True):
        torsion = chain.torsions(m.limited[:, None])[:, 0]
        assert own.shape == (SAMPLES, 2 * AMPLITUDES)
        np.testing.assert_allclose(own[:, :AMPLITUDES].sum(axis=1), torsion)
        np.testing.assert_allclose(own[:, AMPLITUDES:].sum(axis=1), np.gradient(torsion) * RATE)


def test_no_shapes_where_the_drive_train_is_not_known(small_axis: HammersteinWiener) -> None:
    fit = with_residuals([np.zeros(SAMPLES)] * 2)
    shapes = shapes_of_springs(motions(fit, INPUTS), chain_of(small_axis), fit.hypothesis.scale)
    assert [own.shape for own in shapes] == [(SAMPLES, 0)] * 2


def test_a_spring_that_stiffens_is_found_in_the_linear_block() -> None:
    """Simulated in full, the base model as it was."""
    clean = simulated_with(CubicStiffness(), (1e4,), INPUTS)
    measured = [y + white(SAMPLES, SIGMA, seed) for seed, y in enumerate(clean)]
    fit = of_records(measured, base())
    found = block_negative_log_p(fit, INPUTS)
    assert max(found, key=lambda block: found[block]) == "linear", found


def motion(command: FloatArray, limit: float = 1.0) -> Motion:
    limited = np.clip(command, -limit, limit)
    return Motion(command, limited, np.cumsum(limited) / RATE, limited)


def test_after_a_limit_the_shapes_have_its_side_and_end() -> None:
    command = np.full(200, 0.5)
    command[20:30], command[100:110] = 2.0, -2.0
    _, (shapes,) = shapes_of_memories([motion(command)], RATE)["after a limit"]
    splines = shapes[:, : len(AGES_S) - 1].sum(axis=1)
    assert not splines[:30].any() and not splines[100:110].any()
    assert splines[30] == 1 and splines[110] == -1
    assert not splines[30 + int(AGES_S[-1] * RATE) : 100].any()


def test_changes_of_the_command_count_soon_after_a_limit_only() -> None:
    rng = np.random.default_rng(2)
    command = rng.uniform(-0.9, 0.9, 300)
    command[50:60] = 3.0
    _, (shapes,) = shapes_of_memories([motion(command)], RATE)["after a limit"]
    changes = shapes[:, len(AGES_S) - 1 :]
    assert not changes[:60].any() and changes[60:65].all() and not changes[100:].any()


def test_a_limit_that_is_never_reached_has_no_shapes_but_zeros() -> None:
    _, (shapes,) = shapes_of_memories([motion(np.sin(np.arange(100.0)) * 0.5)], RATE)["after a limit"]
    assert not shapes.any()


def test_after_a_reversal_the_shapes_have_the_new_direction() -> None:
    speed = np.concatenate([np.full(40, 1.0), np.zeros(10), np.full(50, -1.0), np.full(60, 1.0)])
    _, (shapes,) = shapes_of_memories([motion(speed, 2.0)], RATE)["after a reversal"]
    total = shapes.sum(axis=1)
    assert not total[:50].any()
    assert total[50] == -1 and total[99] < 0 and total[100] == 1 and not total[155:].any()
