"""Faults made on purpose are found in a sound record, and none is found in it as it is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal
from simulated_records import measured

from bayes_hw import record_checks
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record_checks import check_signals
from bayes_hw.scale_checks import mistakes_of, wrong_scale

RATE_HZ = 20.0
T = np.arange(3000) / RATE_HZ
RNG = np.random.default_rng(5)
U = np.repeat(RNG.normal(0, 1, 150), 20)
Y = np.concatenate([[0.0], np.cumsum(U[:-1]) / RATE_HZ]) + 1e-3 * RNG.standard_normal(len(T))
STUCK = np.where((T > 50) & (T < 58), Y[1001], Y)


def kinds(u: np.ndarray, y: np.ndarray, rate_hz: float = RATE_HZ, expected: float | None = 1.0) -> list[str]:
    scale = wrong_scale(u, y, rate_hz, expected)
    found = (*check_signals(u, y, rate_hz, expected), *([] if scale is None else [scale]))
    return [finding.kind for finding in found]


@pytest.mark.parametrize(
    ("u", "y", "rate_hz", "kind"),
    [
        (U, (2 + Y) % 360, RATE_HZ, "wrapped"),
        (U, (Y - 175 + 180) % 360 - 180, RATE_HZ, "wrapped"),
        (U, np.radians(2 + 10 * Y) % (2 * math.pi), RATE_HZ, "wrapped"),
        (Y, U, RATE_HZ, "swapped"),
        (Y, Y + 0.01, RATE_HZ, "position"),
        (U, -Y, RATE_HZ, "inverted"),
        (U, np.radians(Y), RATE_HZ, "scale"),
        (np.radians(U), Y, RATE_HZ, "scale"),
        (U, 3600 * Y, RATE_HZ, "scale"),
        (U, Y, 60 * RATE_HZ, "scale"),
        (U, STUCK, RATE_HZ, "stuck"),
        (U, np.clip(Y, None, 0.7 * Y.max()), RATE_HZ, "clipped"),
        (U, np.clip(Y, 0.7 * Y.min(), None), RATE_HZ, "clipped"),
    ],
)
def test_a_fault_is_named(u: np.ndarray, y: np.ndarray, rate_hz: float, kind: str) -> None:
    assert kind in kinds(u, y, rate_hz)


@pytest.mark.parametrize("angle", [Y, Y + 134.2, np.round(Y, 2), 0.3 * Y])
def test_a_sound_record_has_none(angle: np.ndarray) -> None:
    """At another origin, in coarse readings, with a slow axis."""
    assert kinds(U, angle) == []


def test_rest_is_no_stuck_encoder() -> None:
    resting = T < 10
    assert kinds(np.where(resting, 0.0, U), np.where(resting, 0.25, Y - Y[201] + 0.25)) == []


def test_a_simulated_axis_with_limits_and_a_dead_zone_has_none(small_axis: HammersteinWiener) -> None:
    for seed in range(5):
        record = measured(small_axis, 2000, seed=seed)
        found = [f for f in check_signals(record.u, record.y, RATE_HZ) if f.severity == "fatal"]
        assert found == []


def test_a_glitch_is_no_wrap() -> None:
    """A jump there that is no whole turn."""
    y = Y.copy()
    y[500] += 123.0
    assert record_checks.wrapped_angle(y) is None


@pytest.mark.parametrize("hour", [3600.0, -3600.0])
def test_a_change_to_summer_time_is_named(hour: float) -> None:
    changed = np.where(T > 70, T + hour, T)
    found = record_checks.clock_change(changed)
    assert found is not None and found.first == np.flatnonzero(T > 70)[0]
    assert record_checks.clock_change(np.where(T > 70, T + 3000, T)) is None


def test_units_that_say_how_fast_the_axis_moves_are_no_fault() -> None:
    assert kinds(U, np.radians(Y), expected=math.radians(1)) == []
    assert kinds(U, np.radians(Y), expected=None) == []


def test_short_records_are_not_judged() -> None:
    assert kinds(U[:40], Y[:40]) == []


def test_a_sweep_through_a_resonance_is_no_position_command() -> None:
    """There the axis's speed lags by a quarter of a turn, as it would behind a position."""
    rate = 100.0
    t = np.arange(3000) / rate
    u = 0.8 * signal.chirp(np.maximum(t - 2, 0), 0.05, 60, 6.0)
    pole, zeta = 2 * np.pi * 2.3, 0.1
    mode = signal.cont2discrete(([pole**2], [1, 2 * zeta * pole, pole**2]), 1 / rate)
    drive = signal.lfilter([0.22], [1, -0.78], u)
    speed = signal.lfilter(np.squeeze(mode[0]), mode[1], drive)
    y = np.cumsum(speed) / rate + 8e-4 * np.random.default_rng(3).standard_normal(len(t))
    assert kinds(u, y, rate) == []


def test_an_output_without_the_command_is_said() -> None:
    rng = np.random.default_rng(6)
    assert kinds(U, rng.standard_normal(len(U))) == ["unrelated"]
    assert kinds(U, np.cumsum(rng.standard_normal(len(U)))) == ["unrelated"]


def test_one_cut_at_the_end_of_the_range_is_no_stuck_encoder() -> None:
    once = np.clip(Y, None, np.sort(Y)[-200])
    assert kinds(U, once) == ["clipped"]


def test_a_wrong_statement_of_the_file_is_named_as_such() -> None:
    """Degrees declared as radians: 57 times too fast, and not the command's unit is wrong."""
    said = mistakes_of(57.0, 50.0, units=("deg/s", "rad"))
    assert said.startswith("the angle is in degrees, not in rad (--output-unit deg --ignore-units)")
    assert "not in rad" not in mistakes_of(57.0, 50.0, units=("deg/s", "deg"))


def test_a_mistake_that_another_explains_far_better_is_not_offered() -> None:
    """0.0162 is radians or minutes of arc, within 8 %; a wrong rate would leave a factor of six."""
    said = mistakes_of(0.0162, 50.0)
    assert "in radians" in said and "minutes of arc" in said and "its rate" not in said
    assert "its rate is rather 20 Hz than 200 Hz" in mistakes_of(10.0, 200.0)


@pytest.mark.parametrize(
    ("gain", "severity"), [(0.08, "warning"), (0.1, "fatal"), (0.0162, "fatal"), (9.0, "fatal")]
)
def test_a_small_gain_that_no_mistake_explains_well_is_doubted_and_not_refused(
    gain: float, severity: str
) -> None:
    """The twin of the paper's axis moves 0.08 times as fast as its command says."""
    rng = np.random.default_rng(3)
    u = np.convolve(rng.standard_normal(4000), np.ones(40) / 40, "same")
    found = wrong_scale(u, np.cumsum(gain * u) / 20, 20.0, 1.0)
    assert found is not None and found.severity == severity


@pytest.mark.parametrize("factor", [2.5, 1 / 2.5])
def test_a_rate_that_nothing_recorded_is_doubted_where_the_motion_speaks_against_it(factor: float) -> None:
    """With stamps too, where nothing but its gain would make an axis so fast; a slower one may be limited."""
    found = wrong_scale(U, Y, factor * RATE_HZ, 1.0, "none")
    assert found is not None and (found.kind, found.severity) == ("rate", "warning")
    assert f"about {RATE_HZ:.3g} Hz" in str(found).replace("19.9", "20").replace("20.1", "20")
    with_stamps = wrong_scale(U, Y, factor * RATE_HZ, 1.0, "s")
    assert (with_stamps is None) == (factor < 1)
    assert with_stamps is None or (with_stamps.kind, with_stamps.severity) == ("rate", "warning")
    assert wrong_scale(U, Y, RATE_HZ, 1.0, "none") is None


@pytest.mark.parametrize(
    ("taken", "true", "factor"), [("us", "ms", 1e3), ("ms", "us", 1e-3), ("s", "min", 60.0)]
)
def test_a_clock_of_another_unit_is_named_by_the_option_that_says_it(
    taken: str, true: str, factor: float
) -> None:
    found = wrong_scale(U, Y, factor * RATE_HZ, 1.0, taken)
    assert found is not None and f"--time-unit {true})" in str(found)


def test_stamps_that_say_what_they_are_leave_the_clock_out() -> None:
    found = wrong_scale(U, Y, 60 * RATE_HZ, 1.0, "")
    assert found is not None and "--time-unit" not in str(found)
