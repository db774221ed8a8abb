"""The measured response: a known integrator, and bands that hold as often as they say."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_axes import GAIN, covered, delayed_integrator, linear_twin, measured, share, three_twins

from bayes_hw.first_look.frequency_response import frequency_response
from bayes_hw.model.excitation import random_phase_multisine, sine_sweep


def test_integrator_with_a_delay_has_its_gain_and_phase() -> None:
    rng = np.random.default_rng(1)
    u = rng.standard_normal(4000)
    record = delayed_integrator(u, 50.0, 3, 1e-6, rng)
    found = frequency_response([record.y], [u], 50.0)
    assert found is not None
    w = 2 * np.pi * found.frequency_hz / 50
    truth = GAIN / 50 * np.exp(-3j * w) / (1 - np.exp(-1j * w))
    np.testing.assert_allclose(found.magnitude, np.abs(truth), rtol=1e-3)
    np.testing.assert_allclose(np.exp(1j * np.deg2rad(found.phase_deg)), truth / np.abs(truth), atol=1e-3)
    np.testing.assert_allclose(found.magnitude * found.rate_factor, GAIN, rtol=1e-3)
    assert found.coherence.min() > 0.999


@pytest.mark.parametrize(
    "kind",
    [
        "sweeps",
        pytest.param("one short sweep", marks=pytest.mark.slow),
        "multisine",
        pytest.param("long sweep", marks=pytest.mark.slow),
    ],
)
def test_band_holds_the_linear_twin_at_94_percent(kind: str) -> None:
    model, answers = linear_twin(), []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        duration, records = {"sweeps": (120, 3), "one short sweep": (60, 1), "long sweep": (600, 1)}.get(
            kind, (120, 1)
        )
        if kind == "multisine":
            commands = [random_phase_multisine(rng, 20, duration, 0.1, 0.05, 8)]
        else:
            commands = [
                sine_sweep(20, duration, 0.3, 0, 5, start_phase_rad=-np.pi / 4 + 0.1 * k)
                for k in range(records)
            ]
        outputs = [measured(model, u, 0.0005, rng).y for u in commands]
        found = frequency_response(outputs, commands, 20.0)
        assert found is not None
        answers += covered(found, model)
    assert len(answers) > 500
    assert 0.92 < share(answers) < 0.97


@pytest.mark.slow
@pytest.mark.parametrize("twin", ["nanshan", "slow", "stiff"])
@pytest.mark.parametrize("kind", ["sweeps", pytest.param("multisine", marks=pytest.mark.slow), "steps"])
def test_bands_of_three_twins_hold_at_90_to_97_percent(twin: str, kind: str) -> None:
    """Of the frequencies with a coherence above 0.8, over twelve seeds, as `look` shows them."""
    model, answers = three_twins()[twin], []
    rate = model.sample_rate_hz
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        duration = 2400 / rate
        if kind == "multisine":
            commands = [random_phase_multisine(rng, rate, duration, rate / 200, 0.05, 0.4 * rate)]
        elif kind == "sweeps":
            commands = [
                sine_sweep(rate, duration, 0.3, 0, rate / 4, start_phase_rad=-np.pi / 4 + 0.1 * k)
                for k in range(3)
            ]
        else:
            held = max(round(rate / 4), 1)
            commands = [np.repeat(rng.uniform(-0.3, 0.3, 2400 // held + 1), held)[:2400] for _ in range(2)]
        outputs = [measured(model, u, 0.01 / rate, rng).y for u in commands]
        found = frequency_response(outputs, commands, rate)
        assert found is not None
        answers += covered(found, model)
    assert len(answers) > 200
    assert 0.90 <= share(answers) <= 0.97


def test_noise_alone_is_not_coherent() -> None:
    rng = np.random.default_rng(3)
    u, y = rng.standard_normal((2, 4000))
    found = frequency_response([np.cumsum(y)], [u], 20.0)
    assert found is not None
    assert float(np.mean(found.coherence > 0.3)) < 0.02


def test_nothing_from_a_handful_of_samples() -> None:
    assert frequency_response([np.zeros(20)], [np.ones(20)], 20.0) is None
