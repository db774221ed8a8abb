"""The report as data: a typed document that render.py writes.

Every string in it is text, never markup, whoever wrote it. Only `Formula` holds markup, and formulas
are constants of equations.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError

State: TypeAlias = Literal["good", "warn", "bad"]

TEXT_WIDTH_INCHES = 6.7
"""Width of the text column of both outputs; a figure drawn this wide keeps its font size in the PDF."""


@dataclass(frozen=True)
class Badge:
    """One check of the first page: what was checked, how it went, and the number behind it."""

    label: str
    state: State
    detail: str


@dataclass(frozen=True)
class Paragraph:
    """Running text."""

    text: str


@dataclass(frozen=True)
class Bullets:
    """A list of short items."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Callout:
    """A boxed remark; "info" is neutral, the other states colour it as a badge."""

    state: State | Literal["info"]
    title: str
    text: str


@dataclass(frozen=True)
class Table:
    """Cells as text, already rounded; columns listed in `numeric` (counted from 0) align right.

    Raises InputError when a row and the header differ in length.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str
    numeric: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for index, row in enumerate(self.rows):
            if len(row) != len(self.header):
                raise InputError(
                    f"report table {self.caption[:40]!r}: row {index} has {len(row)} cells, "
                    f"the header {len(self.header)}; give every row one cell a column"
                )


@dataclass(frozen=True)
class KeyValues:
    """Names and their values, such as a provenance list; values are set in a fixed-width face."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Formula:
    """One displayed formula in Typst math, which both outputs typeset, and its reading in words."""

    typst: str
    words: str


@dataclass(frozen=True)
class Equation:
    """A formula of equations.py with the text that explains its symbols."""

    formula: Formula
    explanation: str = ""


@dataclass(frozen=True)
class Figure:
    """A picture drawn for a light background, transparent outside its marks.

    `svg` is a complete SVG document; `alt_text` says in one sentence what is to be seen, `caption` what
    it shows and how to read it; `width_inches` is the width at which its text has the intended size.
    `breaks` are heights, as shares from the top, where nothing is drawn and a page may end. `narrow_svg` is
    the same drawn for a page as narrow as a telephone's, None where the first is narrow enough.
    """

    svg: str
    caption: str
    alt_text: str
    width_inches: float = TEXT_WIDTH_INCHES
    breaks: tuple[float, ...] = ()
    narrow_svg: str | None = None


@dataclass(frozen=True, eq=False)
class ZoomableRecord:
    """A record, its prediction and their difference, to be zoomed in the HTML page.

    All arrays have shape (samples,); `lower` and `upper` bound the band called `band_label`; `name` is that
    of the record. `still` is the picture that stands in its place in the PDF, on paper and where scripts do
    not run.
    """

    t: FloatArray
    y: FloatArray
    mean: FloatArray
    lower: FloatArray
    upper: FloatArray
    time_unit: str
    output_unit: str
    band_label: str
    still: Figure
    name: str

    def __post_init__(self) -> None:
        if len({len(self.t), *map(len, (self.y, self.mean, self.lower, self.upper))}) != 1:
            raise InputError("zoomable record: t, y, mean, lower and upper must be equally long")


Block: TypeAlias = Paragraph | Bullets | Callout | Table | KeyValues | Equation | Figure | ZoomableRecord


@dataclass(frozen=True)
class Section:
    """A numbered section, listed in the table of contents; one that is `folded` is opened by who doubts, and
    left out of the PDF, which says so."""

    title: str
    blocks: tuple[Block, ...]
    folded: bool = False


@dataclass(frozen=True)
class Report:
    """A whole report: `title`, `verdict`, `badges` and `key_figure` make the first page."""

    title: str
    subtitle: str
    verdict: str
    badges: tuple[Badge, ...]
    key_figure: Figure
    sections: tuple[Section, ...]
