"""The missing force: one that was put in is found, within its own band; noise has none."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import RATE, SIGMA, white
from fitted import SAMPLES, with_residuals
from scipy.stats import norm

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.latent_force import free_residual, latent_force
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.gap.noise.whitener import Plain

T = np.arange(SAMPLES) / RATE


NOISE = Plain(SIGMA)


def response(force: FloatArray) -> FloatArray:
    """What a torque at the motor adds to the output."""
    fit = with_residuals([np.zeros(SAMPLES)])
    chain = fit.hypothesis.chain(fit.values)
    return chain.small_responses("motor_torque", np.ascontiguousarray(force[:, None]))[:, 0]


def with_force(force: FloatArray, seed: int = 0) -> Fit:
    """White noise and the response to a torque at the motor."""
    return with_residuals([white(SAMPLES, SIGMA, 70 + seed) + response(force)])


@pytest.mark.parametrize("seed", range(3))
def test_a_force_is_found_within_its_band(seed: float) -> None:
    """A slow torque of a size that shows: correlation above 0.95, and 94 % bands hold about 94 %."""
    force = 40 * np.sin(2 * np.pi * 0.15 * T + seed) + 20 * np.sin(2 * np.pi * 0.4 * T)
    found = latent_force(with_force(force, int(seed)), 0, NOISE)
    assert found.door == "motor_torque" and found.unit.endswith("/s^2")
    middle = slice(40, -40)
    assert np.corrcoef(found.mean[middle], force[middle])[0, 1] > 0.95
    inside = np.abs(found.mean - force)[middle] < 1.8808 * found.sd[middle]
    assert inside.mean() > 0.8


def test_noise_has_no_force() -> None:
    """Nowhere outside three standard deviations for long, and far below a force that would show."""
    found = latent_force(with_force(np.zeros(SAMPLES)), 0, NOISE)
    assert np.mean(np.abs(found.mean) > 3 * found.sd) < 0.02
    shown = latent_force(with_force(40 * np.sin(2 * np.pi * 0.15 * T)), 0, NOISE)
    assert np.std(found.mean) < 0.1 * np.std(shown.mean)


def test_friction_shows_as_a_step_in_speed() -> None:
    """A torque against the sign of the speed, found with that sign on both sides."""
    speed = latent_force(with_force(np.zeros(SAMPLES)), 0, NOISE).speed
    found = latent_force(with_force(-30 * np.sign(speed)), 0, NOISE)
    fast = np.abs(speed) > np.quantile(np.abs(speed), 0.5)
    assert found.mean[fast & (speed > 0)].mean() == pytest.approx(-30, rel=0.3)
    assert found.mean[fast & (speed < 0)].mean() == pytest.approx(30, rel=0.3)


def test_what_the_force_adds_is_shown_and_noise_fitted_to_it_would_hide_it() -> None:
    """A torque of a period of a second: nine tenths of its response, free of noise; of coloured noise that
    was fitted to the same residuals less is left over."""
    fit = with_force(120 * np.sin(2 * np.pi * 1.0 * T))
    missing = response(120 * np.sin(2 * np.pi * 1.0 * T))

    def lacking(found: FloatArray) -> float:
        return float(np.sum((missing - found) ** 2) / np.sum(missing**2))

    shown = latent_force(fit, 0, NOISE).response
    assert lacking(shown) < 0.1
    assert lacking(latent_force(fit, 0, autoregression(fit)).response) > 2 * lacking(shown)


def test_the_free_residual_of_all_records_stands_one_below_the_other() -> None:
    fit = with_residuals([response(40 * np.sin(T)), white(SAMPLES, SIGMA, 1)])
    table = free_residual(fit, NOISE)
    assert list(table) == ["record", "t", "before", "force", "lo", "hi", "response"]
    assert all(len(column) == 2 * SAMPLES for column in table.values())
    first = latent_force(fit, 0, NOISE)
    np.testing.assert_array_equal(table["force"][table["record"] == 0], first.mean)
    np.testing.assert_allclose(table["hi"][:SAMPLES] - table["lo"][:SAMPLES], 2 * norm.ppf(0.97) * first.sd)
    np.testing.assert_array_equal(table["before"], np.concatenate(fit.simulated))
