"""Delimited text: every finite table is read back, every other one is refused in one line."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.formats.csv_file import read_csv
from bayes_hw.record import Record

COLUMNS = ["t", "u", "y"]
GOOD = "t,u,y\n" + "".join(f"{k / 10},{k % 3},{k % 5}\n" for k in range(40))

files_from_hypothesis = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def read(path, wanted=COLUMNS, most_rows=1000):
    return read_csv(path, wanted, most_rows=most_rows)


def refusal(path, content) -> str:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        read(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


@files_from_hypothesis
@given(
    rows=st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3), max_size=40),
    order=st.permutations(["t", "u", "y", "note"]),
    delimiter=st.sampled_from([",", ";", "\t"]),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    quote=st.sampled_from(["", '"']),
    mark=st.sampled_from(["", "\ufeff"]),
    blank_lines=st.booleans(),
)
def test_every_finite_table_is_read_back_exactly(
    tmp_path, rows, order, delimiter, end, quote, mark, blank_lines
):
    def line(cells):
        return delimiter.join(f"{quote}{cell}{quote}" for cell in cells) + end

    path = tmp_path / "record.csv"
    body = [line(dict(zip(COLUMNS, row, strict=True), note="up").get(n) for n in order) for row in rows]
    content = mark + line(order) + (end if blank_lines else "").join(body)
    path.write_bytes(content.encode())
    table = read(path)
    assert table.names == tuple(order)
    for column, name in enumerate(COLUMNS):
        np.testing.assert_array_equal(table.values[name], [row[column] for row in rows])
    for index in range(len(rows)):
        assert table.place(index) == f"row {2 + index * (1 + blank_lines)}"


def test_a_letter_cut_in_two_is_refused(tmp_path):
    path = tmp_path / "record.csv"
    path.write_bytes(b"\xfe\xff\x00\x00\x00")
    with pytest.raises(InputError, match="ends within a letter"):
        read(path)


@files_from_hypothesis
@given(content=st.binary(max_size=300))
def test_random_bytes_are_a_table_or_refused(tmp_path, content):
    path = tmp_path / "record.csv"
    path.write_bytes(content)
    try:
        read(path)
    except InputError as error:
        assert "\n" not in str(error)


@files_from_hypothesis
@given(cells=st.lists(st.lists(st.text(max_size=6), max_size=5), max_size=5))
def test_random_cells_below_a_good_header_are_numbers_or_refused(tmp_path, cells):
    path = tmp_path / "record.csv"
    content = "t,u,y\n" + "".join(",".join(row) + "\n" for row in cells)
    path.write_bytes(content.encode("utf-8", errors="surrogatepass"))
    try:
        table = read(path)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert not any(np.isinf(values).any() for values in table.values.values())


@pytest.mark.parametrize(
    ("cell", "complaint"),
    [
        ("-inf", "'-inf' is not a finite number"),
        ("1e999", "'1e999' is too large"),
        ("1_000", "'1_000' is not a finite number"),
        ("fast", "'fast' is not a finite number"),
        ("0x10", "'0x10' is not a finite number"),
    ],
)
def test_a_cell_that_is_no_finite_number_is_named_by_row_and_column(tmp_path, cell, complaint):
    lines = GOOD.splitlines()
    lines[16] = f"1.5,{cell},0"
    message = refusal(tmp_path / "a.csv", "\n".join(lines))
    assert message.startswith("row 17, column 'u': ")
    assert complaint in message


def test_rows_are_counted_as_in_the_file_when_some_are_blank(tmp_path):
    content = GOOD.replace("1.5,0,0\n", "\n\n1.5,0,fast\n")
    assert refusal(tmp_path / "a.csv", content).startswith("row 19, column 'y': 'fast'")


@pytest.mark.parametrize("cell", ["", "  ", "nan", "NaN", "NULL", "null", "N/A", "None"])
def test_an_empty_cell_is_unmeasured(tmp_path, cell):
    path = tmp_path / "a.csv"
    path.write_text(GOOD + f"4.0,{cell},1\n4.1,2\n")
    table = read(path)
    assert np.isnan(table.values["u"][40]) and np.isnan(table.values["y"][41])
    assert (table.values["y"][40], table.values["u"][41]) == (1.0, 2.0)


def test_a_comma_in_a_number_is_pointed_out_where_points_are_used(tmp_path):
    assert "'0,5' is not a number; write a decimal point" in refusal(
        tmp_path / "a.csv", GOOD + '4.0,"0,5",1\n' + "4.1,1,1\n" * 400
    )


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("\n\n", "row 1 is blank"),
        (GOOD.replace("t,u,y", "t,u,y,u"), "row 1 has column 'u' twice"),
        (GOOD.encode("utf-16-le"), "is not text"),
        (b"t,u,y\n\x81\x9d,1,1\n", "is not UTF-8 text"),
        (GOOD + "4,1,ÿ", "row 42, column 'y': 'ÿ'"),
        (b"t,u,y\n" + b"1" * 2**21 + b"\n", "line longer than"),
        (GOOD + '4,"' + "1" * 200_000 + '",1\n', "row 42"),
    ],
)
def test_what_is_no_table_is_refused_with_the_reason(tmp_path, content, complaint):
    assert complaint in refusal(tmp_path / "a.csv", content)


def test_missing_columns_are_reported_before_any_cell_is_looked_at(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,command,y\n1,x,x\n")
    table = read(path)
    assert table.missing == ("u",)
    assert table.names == ("t", "command", "y")


def test_reading_stops_after_most_rows(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(GOOD)
    assert [len(v) for v in read(path, most_rows=10).values.values()] == [10, 10, 10]


@pytest.mark.parametrize("rows", [0, 1])
def test_a_table_with_few_rows_keeps_its_columns_apart(tmp_path, rows):
    path = tmp_path / "a.csv"
    path.write_text("".join(itertools.islice(GOOD.splitlines(keepends=True), rows + 1)))
    assert [len(v) for v in read(path).values.values()] == [rows] * 3


@pytest.mark.parametrize("rest", ["", "2,0,0\n" * 5])
def test_a_quote_that_does_not_end_in_its_row_is_refused(tmp_path: Path, rest: str) -> None:
    """It would make one cell of all that follows, of a large file more than memory has."""
    path = tmp_path / "r.csv"
    path.write_text('t,u,y\n0,0,0\n1,"0,0\n' + rest)
    with pytest.raises(InputError, match="quote that does not end in its row"):
        Record.read(path)
