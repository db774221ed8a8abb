"""One meaning, one colour: the colours and drawing settings of every figure and page.

The hues are those of Okabe and Ito (Color Universal Design, jfly.uni-koeln.de/color), which stay apart
under the common colour-vision deficiencies.
"""

from __future__ import annotations

from typing import Any, Final

PAPER: Final = "#ffffff"
INK: Final = "#222222"
MUTED: Final = "#6b6b6b"
GRID: Final = "#d9d9d9"

BLUE: Final = "#0072B2"
VERMILLION: Final = "#D55E00"
GREEN: Final = "#009E73"
PURPLE: Final = "#CC79A7"
SKY: Final = "#56B4E9"
ORANGE: Final = "#E69F00"

DATA: Final = INK
MODEL: Final = BLUE
POSTERIOR: Final = BLUE
LINEAR_BASELINE: Final = VERMILLION
PRIOR: Final = MUTED
POINT_ESTIMATE: Final = VERMILLION
TRUTH: Final = GREEN
RESIDUAL: Final = PURPLE
NOMINAL: Final = MUTED
BAND_PARAMETERS: Final = SKY
BAND_NOISE: Final = "#BFE0F5"

ENSEMBLES: Final = (BLUE, VERMILLION, GREEN, PURPLE, "#8C6D00", "#4477AA", "#882255", "#555555")
"""Colours of sampling ensembles, in order; more than eight start again."""

STATE_COLOURS: Final = {"good": "#00704F", "warn": "#8A5A00", "bad": "#B3261E", "info": "#005A8C"}
"""Colours of badges and callouts on white; a word and a sign always say the same."""

SETTINGS: Final[dict[str, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.formatter.limits": (-6, 7),
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": INK,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.unicode_minus": True,
    "figure.dpi": 100.0,
    "figure.facecolor": "none",
    "font.family": ["DejaVu Sans"],
    "font.size": 9.0,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.2,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "savefig.dpi": 200.0,
    "savefig.facecolor": "none",
    "svg.fonttype": "path",
    "svg.hashsalt": "bayes_hw",
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.color": MUTED,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8.5,
}
"""matplotlib settings of every figure. Text is never read as mathematics: units come from users."""


def ensemble_colour(index: int) -> str:
    """Colour of the ensemble counted from 0."""
    return ENSEMBLES[index % len(ENSEMBLES)]


def page_colours() -> dict[str, dict[str, str]]:
    """Colours of the HTML page by role, for a light and a dark screen."""
    return {
        "light": {
            "paper": PAPER,
            "ink": INK,
            "muted": "#5c5c5c",
            "line": GRID,
            "panel": "#f6f7f9",
            "link": "#005A8C",
            "data": DATA,
            "model": MODEL,
            "residual": RESIDUAL,
            "band": BAND_NOISE,
            **STATE_COLOURS,
        },
        "dark": {
            "paper": "#15181c",
            "ink": "#e6e6e6",
            "muted": "#a5abb3",
            "line": "#3a3f47",
            "panel": "#1e2228",
            "link": "#7cc4f2",
            "data": "#e6e6e6",
            "model": "#58b4ee",
            "residual": "#e08fd0",
            "band": "#234a63",
            "good": "#5fd0a5",
            "warn": "#e8b04a",
            "bad": "#ff8a80",
            "info": "#7cc4f2",
        },
    }
