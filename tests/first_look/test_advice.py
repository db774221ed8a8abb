"""What records of one axis say of it holds, whichever of them is looked at."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.advice import estimate, percent
from bayes_hw.first_look.look import Look, look
from bayes_hw.record import Record, Units

RATE, SIGMA, PLAY = 25.0, 6e-4, 0.005
NUMBER = r"[\d.]+(?:e-?\d+)?"


def _played(motion: FloatArray) -> FloatArray:
    found, output = [], 0.0
    for value in motion.tolist():
        output = min(max(output, value - PLAY), value + PLAY)
        found.append(output)
    return np.array(found)


def _commands() -> dict[str, FloatArray]:
    """A sweep whose strokes are short, triangles at two speeds, random steps."""
    t = np.arange(2000) / RATE
    sweep = 0.6 * signal.chirp(t, 0.05, t[-1], 3.0)
    triangles = np.sign(np.sin(2 * np.pi * t / 8)) * (0.1 + 0.1 * (t // 16 % 2))
    steps = np.repeat(np.random.default_rng(4).uniform(-0.5, 0.5, 100), 20)
    return {"sweep": sweep, "triangles": triangles, "steps": steps}


def _record(name: str, u: FloatArray, seed: int) -> Record:
    """Behind an integrator and two lags, with play."""
    slow = signal.lfilter([0.3], [1.0, -0.7], signal.lfilter([0.4], [1.0, -0.6], u))
    motion = np.concatenate([[0.0], np.cumsum(slow[:-1]) / RATE])
    y = _played(motion) + SIGMA * np.random.default_rng(seed).standard_normal(len(u))
    return Record(name, np.arange(len(u)) / RATE, u, y, RATE, Units())


@pytest.fixture(scope="module")
def looks() -> list[Look]:
    """Each record alone, and all together."""
    records = [_record(name, u, seed) for seed, (name, u) in enumerate(_commands().items(), start=1)]
    return [*(look([record]) for record in records), look(records)]


@pytest.mark.slow
def test_nothing_said_of_dead_zone_and_play_is_false(looks: list[Look]) -> None:
    for seen in looks:
        for item in seen.advice.shows:
            if denied := re.search(rf"^No dead zone.* above ({NUMBER})", item):
                assert float(denied[1]) >= PLAY
            assert not item.startswith("A dead zone of")
            if met := re.search(rf"friction at reversals: half width ({NUMBER}) ± ({NUMBER})", item):
                assert abs(float(met[1]) - PLAY) <= 2 * float(met[2])


@pytest.mark.slow
def test_all_records_together_say_it(looks: list[Look]) -> None:
    assert any(item.startswith("Hysteresis") for item in looks[-1].advice.shows)


@pytest.mark.slow
def test_delays_of_the_same_axis_hold_its_own_and_agree(looks: list[Look]) -> None:
    """The first increment after a command is there at once: one sample, and less than one of dead time."""
    delays = [seen.delay for seen in looks if seen.delay is not None]
    assert len(delays) == len(looks)
    assert all(one.low <= 1 / RATE <= one.high for one in delays)


@pytest.mark.parametrize(
    ("value", "sd", "said"),
    [(0.798, 0.0011, "0.7980 ± 0.0022"), (-1.0, 0.3, "-1.00 ± 0.60"), (0.5, 0.0, "0.5")],
)
def test_estimates_are_told_with_what_they_are_known_to(value: float, sd: float, said: str) -> None:
    assert estimate(value, sd) == said


def test_a_share_that_is_not_zero_is_not_told_as_zero() -> None:
    assert percent(8 / 4500) == "less than 1 %"
    assert percent(0.0) == "0 %"


@pytest.mark.slow
def test_how_fast_slow_motion_is_beside_the_command_is_said(looks: list[Look]) -> None:
    for seen in looks:
        (said,) = (item for item in seen.advice.shows if item.startswith("The frequency response"))
        gain = re.search(r"slow motion has (\d+) % of", said)
        assert gain is not None and int(gain[1]) == pytest.approx(100, abs=5)


@pytest.mark.slow
def test_the_sentence_names_what_is_shown(looks: list[Look]) -> None:
    for seen in looks:
        said, _, lacking = seen.advice.sentence.removeprefix("These records show ").partition(", and lack ")
        assert len(re.split(", | and ", said)) >= len(seen.advice.shows) and lacking
        assert not any(character.isdigit() for character in said)
