"""Names and units of headers, as instruments write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayes_hw.formats.header import split_name
from bayes_hw.reading_options import Columns, ReadingOptions
from bayes_hw.record import Record


@pytest.mark.parametrize("form", ["{} [{}]", "{} ({})", "{}, {}", "{} / {}", "{}/{}", "{}/({})", "{} in {}"])
@pytest.mark.parametrize("unit", ["deg", "deg/s", "arcsec", "mdeg", "°", "s"])
def test_a_unit_is_told_from_its_name(form: str, unit: str) -> None:
    assert split_name(form.format("Axis 1", unit)) == ("Axis 1", unit)


@pytest.mark.parametrize("name", ["axis/angle", "group/t", "az/v", "/encoder.z", "az/el"])
def test_a_path_is_no_unit(name: str) -> None:
    assert split_name(name) == (name, None)


def test_quotes_stand_between_blanks(tmp_path: Path) -> None:
    t = np.arange(64) / 10
    rows = "".join(f"{a:.1f} , {np.sin(a):.6f} , {1000 * a:.3f}\n" for a in t)
    (tmp_path / "log.csv").write_text('"Time, s" , "Rate, deg/s" , "Az, mdeg"\n' + rows)
    options = ReadingOptions(columns=Columns("Time", "Rate", "Az"), units={"output": "deg"})
    np.testing.assert_allclose(Record.read(tmp_path / "log.csv", options=options).y, t)
