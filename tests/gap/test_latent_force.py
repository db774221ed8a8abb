"""The missing force: one that was put in is found, within its own band; noise has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import RATE, SIGMA, white
from fitted import SAMPLES, with_residuals

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit import Fit
from bayes_hw.gap.latent_force import latent_force
from bayes_hw.gap.signals import door_responses
from bayes_hw.gap.stochastic import autoregression

T = np.arange(SAMPLES) / RATE


def with_force(force: FloatArray, seed: int = 0) -> Fit:
    """White noise and the response to a torque at the motor."""
    fit = with_residuals([white(SAMPLES, SIGMA, 70 + seed)])
    chain = fit.hypothesis.chain(fit.values)
    added = door_responses(chain, "motor_torque", np.ascontiguousarray(force[:, None]))[:, 0]
    plain = with_residuals([fit.residuals[0] + added])
    return replace(plain, whitener=autoregression(fit))


@pytest.mark.parametrize("seed", range(3))
def test_a_force_is_found_within_its_band(seed: float) -> None:
    """A slow torque of a size that shows: correlation above 0.95, and 94 % bands hold about 94 %."""
    force = 40 * np.sin(2 * np.pi * 0.15 * T + seed) + 20 * np.sin(2 * np.pi * 0.4 * T)
    found = latent_force(with_force(force, int(seed)), 0)
    assert found.door == "motor_torque" and found.unit.endswith("/s^2")
    middle = slice(40, -40)
    assert np.corrcoef(found.mean[middle], force[middle])[0, 1] > 0.95
    inside = np.abs(found.mean - force)[middle] < 1.8808 * found.sd[middle]
    assert inside.mean() > 0.8


def test_noise_has_no_force() -> None:
    """Nowhere outside three standard deviations for long, and far below a force that would show."""
    found = latent_force(with_force(np.zeros(SAMPLES)), 0)
    assert np.mean(np.abs(found.mean) > 3 * found.sd) < 0.02
    shown = latent_force(with_force(40 * np.sin(2 * np.pi * 0.15 * T)), 0)
    assert np.std(found.mean) < 0.1 * np.std(shown.mean)


def test_friction_shows_as_a_step_in_speed() -> None:
    """A torque against the sign of the speed, found with that sign on both sides."""
    speed = latent_force(with_force(np.zeros(SAMPLES)), 0).speed
    found = latent_force(with_force(-30 * np.sign(speed)), 0)
    fast = np.abs(speed) > np.quantile(np.abs(speed), 0.5)
    assert found.mean[fast & (speed > 0)].mean() == pytest.approx(-30, rel=0.3)
    assert found.mean[fast & (speed < 0)].mean() == pytest.approx(30, rel=0.3)
