"""Torsion of the gear, and a spring that changes with its amplitude."""

from __future__ import annotations

import numpy as np
from drive_axis import MOTOR_ANGLE, RATE, SIGMA, TRAIN, V, W, command, held, white
from fitted import AXIS, SAMPLES, base, of_records, simulated_with, with_residuals

from bayes_hw.gap.criticism.block_functions import block_negative_log_p
from bayes_hw.gap.criticism.free_functions import motions
from bayes_hw.gap.criticism.springs import AMPLITUDES, shapes_of_springs
from bayes_hw.gap.effects.catalogue import CubicStiffness
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

INPUTS = [command(SAMPLES, seed) for seed in range(2)]


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
