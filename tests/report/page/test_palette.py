import itertools

import numpy as np
import pytest

from bayes_hw.report.page import palette
from bayes_hw.report.page.palette import ENSEMBLES, STATE_COLOURS, page_colours

DISTINCT = (palette.DATA, palette.MODEL, palette.LINEAR_BASELINE, palette.TRUTH, palette.RESIDUAL)
LINES = {*DISTINCT, palette.POSTERIOR, palette.PRIOR, *ENSEMBLES}

DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
"""Machado, Oliveira and Fernandes 2009, doi 10.1109/TVCG.2009.113, severity 1.0, on linear RGB."""


def linear_rgb(colour):
    channels = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)


def contrast(first, second):
    """WCAG 2 contrast ratio."""
    high, low = sorted(
        (float(linear_rgb(c) @ [0.2126, 0.7152, 0.0722]) + 0.05 for c in (first, second)), reverse=True
    )
    return high / low


def lab(rgb):
    """CIE L*a*b* of linear RGB."""
    matrix = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = matrix @ np.clip(rgb, 0, 1) / [0.9505, 1.0, 1.089]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("colour", sorted(LINES))
def test_lines_stand_out_on_paper(colour):
    assert contrast(colour, "#ffffff") >= 3


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_text_is_readable(scheme):
    colours = page_colours()[scheme]
    for role in ("ink", "muted", "link", *STATE_COLOURS):
        assert contrast(colours[role], colours["paper"]) >= 4.5, role
        assert contrast(colours[role], colours["panel"]) >= 4.5, role


def test_both_schemes_define_the_same_roles():
    light, dark = page_colours()["light"], page_colours()["dark"]
    assert light.keys() == dark.keys()


@pytest.mark.parametrize("matrix", [np.eye(3), DEUTERANOPIA, PROTANOPIA], ids=["all", "deutan", "protan"])
def test_meanings_stay_apart_under_colour_blindness(matrix):
    for first, second in itertools.combinations(sorted(DISTINCT), 2):
        distance = np.linalg.norm(lab(matrix @ linear_rgb(first)) - lab(matrix @ linear_rgb(second)))
        assert distance > 12, (first, second)
