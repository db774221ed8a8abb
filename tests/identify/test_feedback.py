"""Records of a closed loop are told from those of an open one, at a level that is kept."""

from __future__ import annotations

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.feedback import FeedbackTest, feedback_test
from bayes_hw.identify.output_error import whitened

SAMPLES = 2000
PHI = np.array([0.6])


def _steps(rng: np.random.Generator) -> FloatArray:
    return np.repeat(rng.normal(0, 0.3, SAMPLES // 8), 8)


def _slews(rng: np.random.Generator) -> FloatArray:
    return np.repeat(rng.choice([-0.3, 0.0, 0.3], SAMPLES // 100), 100)


def _loop(rng: np.random.Generator, gain: float) -> FeedbackTest:
    """An integrator under proportional control of its measured angle, a thousandth of it noise."""
    noise = signal.lfilter([0.001], [1.0, -PHI[0]], rng.standard_normal(SAMPLES))
    reference, angle = np.cumsum(_steps(rng)) / 20, 0.0
    u = np.zeros(SAMPLES)
    for k in range(1, SAMPLES):
        u[k] = gain * (reference[k] - angle - noise[k - 1])
        angle += u[k - 1] / 20
    return feedback_test([u], [whitened(noise, PHI)])


def test_the_level_is_kept_in_open_loop() -> None:
    """Uniform p-values under steps and slews: a tenth lies below a tenth, whatever the commands' shape."""
    values = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        commands = [_steps(rng), _slews(rng)]
        values.append(feedback_test(commands, [rng.standard_normal(SAMPLES) for _ in commands]).p_value)
    for level in (0.1, 0.5):
        assert abs(np.mean(np.array(values) < level) - level) < 3 * np.sqrt(level * (1 - level) / 150)


def test_a_closed_loop_is_seen_and_said() -> None:
    for seed, gain in ((1, 0.5), (2, 2.0)):
        found = _loop(np.random.default_rng(seed), gain)
        assert found.closed_loop and "closed loop" in found.sentence


def test_an_open_loop_is_not_called_closed_by_what_the_model_lacks() -> None:
    """Dynamics that a model missed are correlated with commands up to now, and these are allowed for."""
    rng = np.random.default_rng(3)
    u = _steps(rng)
    lacking = signal.lfilter([0.0, 0.3, 0.1], [1.0], u)
    found = feedback_test([u], [rng.standard_normal(SAMPLES) * 0.01 + lacking])
    assert not found.closed_loop and found.sentence == ""


def test_holes_and_constant_commands_say_nothing() -> None:
    rng = np.random.default_rng(4)
    e = rng.standard_normal(SAMPLES)
    e[100:200] = np.nan
    assert not feedback_test([_steps(rng)], [e]).closed_loop
    assert feedback_test([np.ones(SAMPLES)], [e]).p_value == 1.0
