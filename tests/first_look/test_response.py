"""Limits and dead zone found and taken out: the band holds the linear block of nonlinear twins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import SATURATION_LOWER, SATURATION_UPPER, nanshan_model
from simulated_axes import covered, measured, share, three_twins
from twin import TwinExperiment, twin_records

from bayes_hw.first_look.look import Look, look
from bayes_hw.first_look.response import measured_response
from bayes_hw.first_look.statics import statics
from bayes_hw.model.blocks import Saturation
from bayes_hw.model.excitation import random_phase_multisine, sine_sweep


def test_limits_and_dead_zone_of_the_twin() -> None:
    experiment = twin_records(np.random.default_rng(1), noise_share=0.01, dead_zone_half_width=0.002)
    found = statics([r.y for r in experiment.train], [r.u for r in experiment.train], 20.0)
    assert found.lower == pytest.approx(SATURATION_LOWER, abs=0.01)
    assert found.upper == pytest.approx(SATURATION_UPPER, abs=0.015)
    assert found.half_width == pytest.approx(0.002, abs=2e-4)


def test_no_limit_where_the_command_stays_inside() -> None:
    rng = np.random.default_rng(2)
    u = random_phase_multisine(rng, 20, 200, 0.08, 0.02, 6)
    found = statics([measured(nanshan_model(0.0), u, 0.0005, rng).y], [u], 20.0)
    assert (found.lower, found.upper, found.half_width) == (None, None, None)


@pytest.fixture(scope="module")
def strong() -> tuple[TwinExperiment, Look]:
    """A twin that meets its limits and crosses its dead zone, and the look at its records."""
    experiment = twin_records(np.random.default_rng(2), amplitude=0.5)
    return experiment, look(experiment.train)


@pytest.mark.parametrize(
    "kind",
    [
        "both",
        pytest.param("dead zone", marks=pytest.mark.slow),
        pytest.param("multisine", marks=pytest.mark.slow),
    ],
)
def test_band_holds_the_linear_block_of_a_nonlinear_twin(
    kind: str, strong: tuple[TwinExperiment, Look]
) -> None:
    rng, (experiment, seen) = np.random.default_rng(2), strong
    model = experiment.truth
    if kind == "multisine":
        u = random_phase_multisine(rng, 20, 300, 0.2, 0.02, 6)
        model = nanshan_model(0.002)
        seen = look([measured(model, u, 0.001, rng)])
    elif kind == "dead zone":
        experiment = twin_records(rng, amplitude=0.3)
        seen, model = look(experiment.train), experiment.truth
    assert seen.response is not None
    answers = covered(seen.response.linear, model)
    assert len(answers) > 60
    assert 0.9 <= share(answers) <= 0.98


@pytest.mark.parametrize("kind", [pytest.param("slow sweeps", marks=pytest.mark.slow), "stiff multisine"])
def test_band_holds_the_linear_block_where_limits_are_just_met(kind: str) -> None:
    """Sweeps of a slow axis reach their limits by little; a stiff axis answers faster than 20 Hz tells."""
    twin, command = kind.split()
    model, answers = three_twins()[twin], []
    rate = model.sample_rate_hz
    for seed in (7101,):
        rng = np.random.default_rng(seed)
        if command == "sweeps":
            phases = -np.pi / 4 + 0.1 * np.arange(3)
            commands = [sine_sweep(rate, 240, 0.3, 0, rate / 4, start_phase_rad=p) for p in phases]
        else:
            commands = [random_phase_multisine(rng, rate, 2400 / rate, rate / 200, 0.05, 0.4 * rate)]
        top = float(np.quantile(np.abs(np.concatenate(commands)), 0.9))
        limited = replace(model, saturation=Saturation(-0.95 * top, top))
        outputs = [measured(limited, u, 0.01 / rate, rng).y for u in commands]
        found = statics(outputs, commands, rate)
        assert found.lower == pytest.approx(-0.95 * top, rel=0.05)
        assert found.upper == pytest.approx(top, rel=0.05)
        seen = measured_response(outputs, commands, rate, found)
        assert seen is not None
        answers += covered(seen.linear, limited)
    assert 0.90 <= share(answers) <= 0.97


def test_raw_response_is_smaller_where_limits_are_met(strong: tuple[TwinExperiment, Look]) -> None:
    _, seen = strong
    assert seen.response is not None
    low = seen.response.linear.frequency_hz < 0.3
    assert np.median((seen.response.best_linear.magnitude / seen.response.linear.magnitude)[low]) < 0.95


@pytest.mark.slow
def test_a_beginning_that_was_not_measured_is_no_dead_zone() -> None:
    """The angle from which it would count is then unknown; where the axis begins is estimated."""
    rng = np.random.default_rng(8)
    u = np.concatenate([np.zeros(50), np.repeat(rng.uniform(-0.5, 1.0, 60), 40), np.zeros(50)])
    whole = measured(three_twins()["slow"], u, 1e-4, rng)
    shown = whole.y > 2.0
    clipped = replace(whole, measured=shown & (np.arange(len(u)) > 60))
    assert 0.03 < np.mean(~shown) < 0.4
    wrong = statics([clipped.y - clipped.y[0]], [u], whole.sample_rate_hz)
    assert wrong.half_width is not None and wrong.half_width > 0.5
    seen, complete = look([clipped]), look([whole])
    assert seen.statics.half_width is None
    assert seen.response is not None and complete.response is not None
    known, all_of_it = (np.mean(r.linear.coherence > 0.8) for r in (seen.response, complete.response))
    assert known > 0.8 * all_of_it
