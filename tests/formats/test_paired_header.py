"""TwinCAT Scope's header: channels with a clock of their own, a property a row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayes_hw.formats.header import paired_header
from bayes_hw.record import Columns, ReadingOptions, Record

PROPERTIES = (
    ("Name", "Axis1.SetVelo", "Axis1.ActPos"),
    ("SymbolComment", "", ""),
    ("Data-Type", "REAL64", "REAL64"),
    ("SampleTime[ms]", "2", "2"),
    ("ScaleFactor", "1", "1"),
    ("Unit", "deg/s", "(deg)"),
)


@pytest.mark.parametrize("separator", ["\t", ";"])
def test_channels_are_named_with_units_and_clock(tmp_path: Path, separator: str) -> None:
    """The project's own `Name` above is none of a channel; a second clock 1 ms late is taken where asked."""
    k = np.arange(300)
    u, y = np.sin(0.05 * k), np.cumsum(np.sin(0.05 * k)) * 0.002
    lines = [f"Name{separator}Scope Project", f"File{separator}C:\\scope\\p.sv2", ""]
    lines += [separator.join([key, first, key, second]) for key, first, second in PROPERTIES]
    lines += [
        "",
        *(
            f"{2 * i}{separator}{a:.8f}{separator}{2 * i + 1}{separator}{b:.8f}"
            for i, a, b in zip(k, u, y, strict=True)
        ),
    ]
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    columns = Columns("time", "Axis1.SetVelo", "Axis1.ActPos")
    record = Record.read(path, columns=columns)
    assert record.sample_rate_hz == 500 and len(record) == 300
    assert (record.units.input, record.units.output) == ("deg/s", "deg")
    np.testing.assert_allclose(record.u, u, atol=1e-8)
    np.testing.assert_allclose(record.y, y, atol=1e-8)
    late = Record.read(
        path, options=ReadingOptions(columns=columns, output_time="Axis1.ActPos time", gaps="bridge")
    )
    np.testing.assert_allclose(
        late.y[5:290], np.interp(2.0 * k, 2.0 * k + 1, y)[-len(late) :][5:290], atol=1e-3
    )


def test_other_blocks_are_no_such_header() -> None:
    assert paired_header([["a", "1", "a", "2"], ["b", "1", "b", "2"], ["c", "1", "c", "2"]], 4) is None
    assert paired_header([["Name", "x", "Name", "y"], ["Unit", "deg", "Unit", "deg"]], 4) is None
    assert paired_header([["Name", "x", "Other", "y"]] * 4, 4) is None
