"""What an engineer types at a prompt or in a notebook: short answers, arrays and tables, signatures."""

from __future__ import annotations

import inspect
import pydoc
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_files import few_orders
from simulated_records import measured

import bayes_hw as hw
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

T = np.arange(200) / 20
U, Y = np.sin(T), 134.2 - np.cos(T)


def test_a_record_of_arrays() -> None:
    stamped, counted = Record.from_arrays(T, U, Y), Record.from_arrays(u=U, y=Y, sample_rate_hz=20)
    assert stamped.sample_rate_hz == counted.sample_rate_hz == pytest.approx(20)
    np.testing.assert_array_equal(stamped.t, counted.t)
    np.testing.assert_array_equal(stamped.y, Y)
    assert stamped.units == hw.Units()
    other = Record.from_arrays(T.tolist(), U, Y, units={"input": "V"}, name="bench")
    assert other.units.input == "V" and other.name == "bench"
    assert not Record.from_arrays(T, U).has_output


@pytest.mark.parametrize(
    ("arguments", "options", "said"),
    [
        ((), {"y": Y}, "no command"),
        ((None, U, Y), {}, "neither time nor rate"),
        ((T[::-1], U, Y), {}, "t does not increase"),
        ((T**1.1, U, Y), {}, "t is not uniform"),
        ((T, U, Y), {"sample_rate_hz": 200}, "t says 20 Hz, sample_rate_hz says 200 Hz"),
        (
            (np.where(T < 5, T, T + 3600), U, Y),
            {},
            r'jumps forward by an hour.*ReadingOptions\(gaps="bridge"\)',
        ),
        ((T, U[:-1], Y), {}, "columns of one length"),
        ((T, np.stack([U, U]), Y), {}, "one value a sample"),
        ((T, ["fast"] * 200, Y), {}, "u holds what is no number"),
        ((T, U, Y), {"units": {"angle": "deg"}}, "units: unknown key"),
    ],
)
def test_arrays_that_are_no_record(
    arguments: tuple[object, ...], options: dict[str, object], said: str
) -> None:
    with pytest.raises(hw.InputError, match=said):
        Record.from_arrays(*arguments, **options)  # type: ignore[arg-type]


def test_what_is_wrong_with_arrays_is_mended_by_the_options_of_files() -> None:
    """A turn, a sign, an hour; with a rate in place of stamps too."""
    wrapped = Record.from_arrays(T, U, (10 * Y) % 6, options=hw.ReadingOptions(unwrap=6.0))
    np.testing.assert_allclose(wrapped.y, 10 * (Y - Y[0]), atol=1e-9)
    turned = Record.from_arrays(u=U, y=Y, sample_rate_hz=20, options=hw.ReadingOptions(reverse=True))
    np.testing.assert_array_equal(turned.y, -Y)
    late = np.where(T < 5, T, T + 3600)
    whole = Record.from_arrays(late, U, Y, options=hw.ReadingOptions(gaps="bridge"))
    np.testing.assert_array_equal(whole.y, Y)
    np.testing.assert_allclose(whole.t, T, atol=1e-9)
    paused = np.where(T < 5, T, T + 100)
    split = hw.ReadingOptions(gaps="split")
    with pytest.raises(hw.InputError, match=r"2 records of it; take one with .*part_s"):
        Record.from_arrays(paused, U, Y, options=split)
    first = Record.from_arrays(paused, U, Y, options=hw.ReadingOptions(part_s=(0, 5)))
    np.testing.assert_array_equal(first.y, Y[:100])


def test_tables_in_and_out() -> None:
    """By any names, with dates for an index; and the same columns come back."""
    record = Record.from_arrays(T, U, Y)
    pd.testing.assert_frame_equal(record.to_dataframe(), pd.DataFrame({"t": T, "u": U, "y": Y}))
    back = Record.from_dataframe(record.to_dataframe())
    np.testing.assert_array_equal(back.y, Y)
    index = pd.date_range("2026-03-01", periods=200, freq="50ms", tz="UTC")
    table = pd.DataFrame({"command": U, "angle": Y}, index=index)
    dated = Record.from_dataframe(table, columns=hw.Columns(input="command", output="angle"))
    assert dated.sample_rate_hz == pytest.approx(20) and dated.t[0] == 0
    found = Record.from_dataframe(table)
    np.testing.assert_array_equal(found.y, Y)
    assert found.options.columns == hw.Columns("t", "command", "angle")
    with pytest.raises(hw.InputError, match="no column 't' for the time"):
        Record.from_dataframe(pd.DataFrame({"u": U, "y": Y}))


def test_what_is_nan_was_not_measured() -> None:
    """In an array and in a table, and a table comes back with its holes."""
    holes = np.where(np.arange(200) % 40 == 7, np.nan, Y)
    bridged = hw.ReadingOptions(gaps="bridge")
    for record in (
        Record.from_arrays(T, U, holes),
        Record.from_dataframe(pd.DataFrame({"t": T, "u": U, "y": holes}), options=bridged),
    ):
        np.testing.assert_array_equal(record.measured_samples, np.isfinite(holes))
        back = Record.from_dataframe(record.to_dataframe(), options=bridged)
        np.testing.assert_array_equal(back.y_or_nan, holes)
    alone = Record.from_dataframe(pd.DataFrame({"u": U}), sample_rate_hz=20)
    assert not alone.has_output and alone.sample_rate_hz == 20


def test_a_table_is_read_as_a_file_is() -> None:
    """Missing rows, a wrapped angle, dates in a column, units, another column beside."""
    dates = pd.Timestamp("2026-03-01", tz="Europe/Berlin") + pd.to_timedelta(T, unit="s")
    table = pd.DataFrame({"at": dates, "u": U, "y": np.mod(2 * Y, 1), "wind": np.sin(T)}).drop(index=[50, 90])
    columns = hw.Columns(time="at")
    with pytest.raises(hw.InputError, match='gaps="bridge"'):
        Record.from_dataframe(table, columns=columns)
    options = hw.ReadingOptions(gaps="bridge", known=("wind",), unwrap=1)
    record = Record.from_dataframe(
        table, columns=columns, units={"input": "rad/s"}, options=options, name="a.b"
    )
    assert record.name == "a.b" and record.units.input == "rad/s" and set(record.known) == {"wind"}
    assert np.flatnonzero(~record.measured_samples).tolist() == [50, 90]
    seen = record.measured_samples
    np.testing.assert_allclose(np.diff(record.y[seen]), np.diff(2 * Y[seen]), atol=1e-9)


def test_help_shows_the_arguments() -> None:
    for name in ("identify", "sample", "diagnose"):
        function = getattr(hw, name)
        parameters = inspect.signature(function).parameters
        assert {"seed", "start", "origin"} <= set(parameters)
        assert not any(p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) for p in parameters.values())
        assert "origin" in pydoc.render_doc(function)


def test_a_warning_points_at_the_callers_line() -> None:
    """Of what a function three deep in the package has to say."""
    with pytest.warns(hw.BayesHWWarning) as caught:
        hw.look(Record.from_arrays(np.arange(1200) / 20, np.tile(U, 6), -np.cumsum(np.tile(U, 6)) / 20))
    assert {warning.filename for warning in caught} == {__file__}


def test_answers_are_short(
    small_axis: HammersteinWiener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few_orders(monkeypatch)
    record = measured(small_axis, 400, seed=1)
    found = hw.identify(record)
    for shown in (record, small_axis, found):
        assert len(repr(shown)) < 400 and "\n" not in repr(shown)
        assert "<script" not in shown._repr_html_()
    assert "angle" in repr(record) and "limits -0.8 to 1 deg/s" in repr(small_axis)
    found.model.write(str(tmp_path / "model.json"))
    assert hw.HammersteinWiener.read(tmp_path / "model.json").name == found.model.name


def test_a_name_is_no_markup() -> None:
    assert "<b>" not in Record.from_arrays(T, U, Y, name="<b>x</b>")._repr_html_()


def test_an_index_that_is_a_clock() -> None:
    """One that has a name or fractions; the number of a row is none. A name twice is refused."""
    table = pd.DataFrame({"t": T, "u": U, "y": Y})
    for indexed in (table.set_index("t"), pd.DataFrame({"u": U, "y": Y}, index=T)):
        found = Record.from_dataframe(indexed)
        np.testing.assert_allclose(found.t, T)
        np.testing.assert_array_equal(found.y, Y)
    with pytest.raises(hw.InputError, match="column 'y' is there twice"):
        Record.from_dataframe(pd.concat([table, table["y"]], axis=1))
