"""The document as plain data: the one form that both templates read."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.report.page.document import (
    Block,
    Bullets,
    Callout,
    Equation,
    Figure,
    KeyValues,
    Paragraph,
    Report,
    Table,
    ZoomableRecord,
)
from bayes_hw.report.page.typography import visible

ZOOM_SAMPLES = 24_000
"""Most samples of a record that the page carries for zooming."""


MOST_DRAWN_TWICE = 700_000
"""Characters of all drawings of a page beyond which none is there a second time, for a telephone."""


def report_content(report: Report) -> dict[str, Any]:
    """`report` as dictionaries, lists and text, with figures, tables and sections numbered from 1.

    Every string but SVG, Typst math and base64 data has passed through `visible`.
    """
    numbers = {"figure": 1, "table": 0, "equation": 0}
    twice = sum(len(figure.svg) for figure in _drawings(report)) <= MOST_DRAWN_TWICE
    return {
        "title": visible(report.title),
        "subtitle": visible(report.subtitle),
        "verdict": visible(report.verdict),
        "badges": [
            {"label": visible(b.label), "state": b.state, "detail": visible(b.detail)} for b in report.badges
        ],
        "key_figure": _figure(report.key_figure, 1, twice),
        "sections": [
            {
                "number": index,
                "id": f"section-{index}",
                "title": visible(section.title),
                "folded": section.folded,
                "blocks": [_block(block, numbers, twice) for block in section.blocks],
            }
            for index, section in enumerate(report.sections, start=1)
        ],
    }


def _drawings(report: Report) -> list[Figure]:
    blocks = [block for section in report.sections for block in section.blocks]
    stills = [block.still for block in blocks if isinstance(block, ZoomableRecord)]
    return [report.key_figure, *(block for block in blocks if isinstance(block, Figure)), *stills]


def _block(block: Block, numbers: dict[str, int], twice: bool) -> dict[str, Any]:
    match block:
        case Paragraph(text):
            return {"kind": "paragraph", "text": visible(text)}
        case Bullets(items):
            return {"kind": "bullets", "items": [visible(item) for item in items]}
        case Callout(state, title, text):
            return {
                "kind": "callout",
                "state": state,
                "title": visible(title),
                "text": visible(text),
            }
        case KeyValues(items):
            return {"kind": "key_values", "items": [[visible(k), visible(v)] for k, v in items]}
        case Table():
            return {
                "kind": "table",
                "number": _next(numbers, "table"),
                "header": [visible(cell) for cell in block.header],
                "rows": [[visible(cell) for cell in row] for row in block.rows],
                "caption": visible(block.caption),
                "numeric": [index in block.numeric for index in range(len(block.header))],
            }
        case Equation(formula, explanation):
            return {
                "kind": "equation",
                "number": _next(numbers, "equation"),
                "typst": formula.typst,
                "words": formula.words,
                "explanation": visible(explanation),
            }
        case Figure():
            return _figure(block, _next(numbers, "figure"), twice)
        case ZoomableRecord():
            return _figure(block.still, _next(numbers, "figure"), twice) | {
                "kind": "zoomable_record",
                "series": _series(block),
                "time_unit": visible(block.time_unit),
                "output_unit": visible(block.output_unit),
                "band_label": visible(block.band_label),
                "live_caption": visible(
                    f"The record “{block.name}”, its prediction and the {block.band_label}, to be zoomed; "
                    "below, record minus prediction. Printed, and in the PDF, a still picture stands here."
                ),
            }


def _figure(figure: Figure, number: int, twice: bool) -> dict[str, Any]:
    return {
        "kind": "figure",
        "number": number,
        "svg": figure.svg,
        "narrow_svg": figure.narrow_svg if twice else None,
        "caption": visible(figure.caption),
        "alt": visible(figure.alt_text),
        "width_inches": figure.width_inches,
        "breaks": list(figure.breaks),
    }


def _next(numbers: dict[str, int], kind: str) -> int:
    numbers[kind] += 1
    return numbers[kind]


def _series(record: ZoomableRecord) -> dict[str, Any]:
    """The record as base64: times in 64 bits, angles in 32 bits less `origin`, which keeps their digits.

    Of a record longer than ZOOM_SAMPLES, each stretch of samples keeps its smallest and largest values.
    """
    stretch = -(-2 * len(record.t) // ZOOM_SAMPLES) if len(record.t) > ZOOM_SAMPLES else 1
    origin = float(np.median(record.y))
    angles = {
        "y": record.y - origin,
        "mean": record.mean - origin,
        "lower": record.lower - origin,
        "upper": record.upper - origin,
        "residual": record.y - record.mean,
    }
    times = record.t if stretch == 1 else np.repeat(record.t[::stretch], 2)
    return {
        "t": _base64(times, "<f8"),
        "origin": origin,
        **{name: _base64(extremes(v, stretch), "<f4") for name, v in angles.items()},
    }


def extremes(values: FloatArray, stretch: int) -> FloatArray:
    """Smallest and largest of every `stretch` samples in turn, shape (2 * stretches,)."""
    if stretch == 1:
        return values
    starts = np.arange(0, len(values), stretch)
    pair = [np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)]
    return np.column_stack(pair).ravel()


def _base64(values: FloatArray, dtype: str) -> str:
    """The values in that type, what runs away at its largest."""
    largest = np.finfo(dtype).max
    return base64.b64encode(np.clip(values, -largest, largest).astype(dtype).tobytes()).decode("ascii")
