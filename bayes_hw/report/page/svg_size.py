"""The SVG of a drawing, a third of the size that matplotlib writes, with nothing to be seen of it."""

from __future__ import annotations

import io
import re

from matplotlib.figure import Figure as Canvas

POINTS_AN_INCH = 72
LONG_PATH = 400
"""Characters from which a path is a curve of many points, that need no more than a tenth of a point."""

_GEOMETRY = re.compile(r'\b(d|x|y|points)="([^"]*)"')
_COORDINATE = re.compile(r"-?\d+\.\d{3,}")
_SPACED_COMMAND = re.compile(r"\s*([A-Za-z])\s*")
_COMMENT_OR_INDENT = re.compile(r"<!--.*?-->|(?<=>)\s+(?=<)", re.DOTALL)
_GROUP_NAME = re.compile(r'<g id="[^"]*"')
_STYLE_SPACE = re.compile(r"(?<=[;:]) (?=[\w#-])")
_TRANSLATION = re.compile(r"translate\([^)]*\)")
_GLYPH = re.compile(r'(id="|href="#)DejaVuSans-')
_STYLE = re.compile(r' style="[^"]*"')
_POLYLINES = re.compile(r"(?:\s*M\s*-?[\d.]+\s+-?[\d.]+(?:\s*L\s*-?[\d.]+\s+-?[\d.]+)*(?:\s*z)?)+\s*")
_VERTEX = re.compile(r"([MLz])\s*(?:(-?[\d.]+)\s+(-?[\d.]+))?")


def svg_of(canvas: Canvas) -> str:
    """The drawing as SVG, the same bytes for the same drawing.

    It is laid out before: left to itself, matplotlib draws all once more to lay it out.
    """
    canvas.set_dpi(POINTS_AN_INCH)
    lay_out(canvas)
    engine = canvas.get_layout_engine()
    buffer = io.StringIO()
    canvas.set_layout_engine(None)
    canvas.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    canvas.set_layout_engine(engine)
    return compact(buffer.getvalue())


def lay_out(canvas: Canvas) -> None:
    """Place the axes of the drawing, where matplotlib is to."""
    engine = canvas.get_layout_engine()
    if engine is not None:
        engine.execute(canvas)


def compact(svg: str) -> str:
    """Coordinates to a hundredth of a point, in long polylines relative and to a tenth; no comments."""
    bare = _GROUP_NAME.sub("<g", _COMMENT_OR_INDENT.sub("", svg))
    bare = _GLYPH.sub(r"\1g", bare)
    bare = _TRANSLATION.sub(lambda move: _COORDINATE.sub(_hundredth, move[0]), bare)
    bare = _STYLE.sub(lambda style: _STYLE_SPACE.sub("", style[0]), bare)
    return _GEOMETRY.sub(_attribute, bare)


def _attribute(match: re.Match[str]) -> str:
    name, data = match.groups()
    if name == "d" and len(data) > LONG_PATH and _POLYLINES.fullmatch(data):
        return f'd="{_relative(data)}"'
    shorter = _SPACED_COMMAND.sub(r"\1", _COORDINATE.sub(_hundredth, data)).strip()
    return f'{name}="{shorter}"'


def _hundredth(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")


def _relative(data: str) -> str:
    """Polylines as steps in tenths of a point, each from where the rounded ones before it arrived."""
    written: list[str] = []
    at = (0, 0)
    for command, x, y in _VERTEX.findall(data):
        if command == "z":
            written.append("z")
            continue
        to = (round(10 * float(x)), round(10 * float(y)))
        if command == "M":
            written.append("M" + _pair(*to))
        elif to != at:
            step = _pair(to[0] - at[0], to[1] - at[1])
            started = written[-1][0] == "M"
            written.append("l" + step if started else step if step[0] == "-" else " " + step)
        at = to
    return "".join(written)


def _pair(x: int, y: int) -> str:
    second = _tenths(y)
    return _tenths(x) + ("" if second.startswith("-") else " ") + second


def _tenths(value: int) -> str:
    text = f"{value / 10:.1f}".removesuffix(".0")
    return re.sub(r"^(-?)0\.", r"\1.", text)
