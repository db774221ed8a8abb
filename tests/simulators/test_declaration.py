"""The TOML file beside a simulator: what it says, and what is said where it is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from example_axis import DECLARED, DECLARED_LOOP

from bayes_hw.errors import InputError
from bayes_hw.simulators.declaration import Declaration


def read(folder: Path, text: str) -> Declaration:
    path = folder / "axis.toml"
    path.write_text(text)
    return Declaration.read(path)


def test_what_is_declared_is_read(tmp_path: Path) -> None:
    found = read(tmp_path, DECLARED + DECLARED_LOOP)
    assert found.actuators == ("rate", "hold")
    assert found.measured == {"joint": "azimuth"}
    assert [door.name for door in found.doors] == ["motor", "load", "compliance"]
    assert found.loop is not None
    assert found.loop.limit == 1000.0
    np.testing.assert_allclose(found.input_factor, np.pi / 180)
    np.testing.assert_allclose(found.output_factor, 180 / np.pi)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('joint = "azimuth"\nunit', "unit", "measured: give one of joint, sensor and variable"),
        ("relative_sd = 0.15", "relative_sd = 0", "uncertain.relative_sd: 0 is not positive"),
        ("relative_sd = 0.15", 'relative_sd = "x"', "uncertain.relative_sd: must be a number"),
        ("[forces.load]", "[forces.wheel]", "forces.wheel: unknown; use motor, load, compliance"),
        ('simulator_unit = "rad/s"', 'simulator_unit = "kg"', "kg"),
        ("[record]", "[records]", "records: unknown"),
        ('actuators = ["rate", "hold"]', "", "command.actuators: is missing"),
        ("[noise]", "[noise", "is not TOML"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said.replace("[", r"\[")) as refused:
        read(tmp_path, DECLARED.replace(old, new, 1))
    assert "\n" not in str(refused.value)
