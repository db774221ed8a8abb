"""Controllers: their file, their response, and what they refuse."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

from bayes_hw.control.controller import Controller
from bayes_hw.control.notch import Notch
from bayes_hw.control.python_control import controller_system
from bayes_hw.errors import InputError

FULL = Controller(
    "full",
    20.0,
    2.0,
    0.5,
    0.3,
    0.1,
    (-0.3, 0.4),
    1.5,
    0.8,
    2,
    (Notch(3.3, 0.03, 0.2), Notch(3.7, 0.03, 0.3)),
    4.0,
)


@pytest.mark.parametrize(
    "controller", [FULL, Controller("P", 10.0, 3.0), replace(FULL, anti_windup_s=np.inf)]
)
def test_file_keeps_every_setting(controller: Controller, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    controller.write(path, "deg/s", "deg")
    assert Controller.read(path) == controller
    units = json.loads(path.read_text())["units"]
    assert units["proportional"] == "(deg/s)/deg"
    assert units["integral"] == "(deg/s)/deg/s"


def test_response_is_that_of_textbook_blocks() -> None:
    """PID by backward differences, low pass and delay, written out with python-control."""
    period = 0.05
    controller = replace(FULL, notches=())
    z = control.tf([1, 0], [1], period)
    integral = 0.5 * period * z / (z - 1)
    derivative = 0.3 * (z - 1) / ((0.1 + period) * z - 0.1)
    w = 2 / period * np.tan(np.pi * 4.0 * period)
    s = 2 / period * (z - 1) / (z + 1)
    expected = (2.0 + integral + derivative) * (w / (s + w)) / z**2
    frequency = np.array([0.01, 0.3, 2.0, 9.0])
    points = np.exp(2j * np.pi * frequency * period)
    np.testing.assert_allclose(controller.response(frequency), expected(points), rtol=1e-10)


def test_state_space_has_the_same_response() -> None:
    frequency = np.array([0.01, 0.3, 2.0, 3.3, 9.0])
    found = controller_system(FULL)(np.exp(2j * np.pi * frequency / 20.0))
    np.testing.assert_allclose(found, FULL.response(frequency), rtol=1e-9)


@pytest.mark.parametrize(
    ("letters", "gains"),
    [("P", {}), ("PI", {"integral": 1.0}), ("PID", {"integral": 1.0, "derivative": 0.1})],
)
def test_kind(letters: str, gains: dict[str, float]) -> None:
    assert Controller("c", 20.0, 1.0, **gains).kind == letters  # type: ignore[arg-type]


def test_memory_of_the_forms() -> None:
    """The plain incremental form takes the whole excess back, back-calculation a share, wind-up nothing."""
    plain = Controller("c", 20.0, 1.0, 1.0)
    assert plain.memory_share == 1
    assert replace(plain, anti_windup_s=0.5).memory_share == pytest.approx(0.1)
    assert replace(plain, anti_windup_s=np.inf).memory_share == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"proportional": -1}, "proportional: must be finite and zero or more"),
        ({"proportional": "1"}, "proportional: missing or not a number"),
        ({"proportional": 0, "integral": 0}, "must be positive"),
        ({"sample_rate_hz": None}, "sample_rate_hz"),
        ({"speed_limit": [0.1, 0.2]}, "lower < 0 < upper"),
        ({"rate_of_change_limit": 0}, "rate_of_change_limit: must be positive"),
        ({"delay_samples": 0.5}, "whole number"),
        ({"notches": [{"frequency_hz": 3}]}, "notches[0]"),
        ({"notches": 3}, "notches: must be a list"),
        ({"low_pass_hz": 10}, "low_pass_hz"),
        ({"kp": 1}, "unknown key 'kp'"),
        ({"type": "PID"}, "type: is 'PID'"),
        ({"anti_windup_s": -1}, "anti_windup_s"),
        ({"delay_samples": 2**64}, "delay_samples: must be from zero to 1000"),
        ({"delay_samples": 20000}, "delay_samples: must be from zero to 1000"),
        ({"proportional": 10**400}, "proportional: must be finite"),
        (
            {"notches": [{"frequency_hz": 2, "numerator_damping": 0.1, "denominator_damping": 10**400}]},
            "too large",
        ),
    ],
)
def test_what_is_wrong_is_said_with_file_and_key(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"sample_rate_hz": 20, "proportional": 1, "integral": 1} | change))
    with pytest.raises(InputError) as raised:
        Controller.read(path)
    assert message in str(raised.value) and str(path) in str(raised.value)


@pytest.mark.parametrize("text", ["[1]", "{", ""])
def test_a_file_that_is_no_controller(text: str, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"c\.json"):
        Controller.read(path)


def test_the_example_of_the_how_to_is_a_controller() -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "design_a_loop.md"
    text = page.read_text(encoding="utf-8")
    example = text.split("```json")[1].split("```")[0]
    controller = Controller.from_dict(json.loads(example))
    assert controller.kind == "PI" and controller.memory_share == 1 and len(controller.notches) == 1


def test_rates_must_divide() -> None:
    assert Controller("c", 5.0, 1.0).ratio_to(20.0) == 4
    for rate in (40.0, 15.0, 19.9):
        with pytest.raises(InputError, match="does not divide"):
            Controller("c", rate, 1.0).ratio_to(20.0)
