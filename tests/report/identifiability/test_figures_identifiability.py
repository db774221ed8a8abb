"""Figures of identifiability and of experiments say what is flat, open or outside, in colour and in words."""

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.report.experiment.figures_experiment import (
    CheckRow,
    GainBar,
    PlayedCommand,
    WidthRow,
    command,
    gains,
    width_check,
    widths,
)
from bayes_hw.report.identifiability.figures_identifiability import (
    ContractionRow,
    RatioPanel,
    RidgePanel,
    SpectrumPanel,
    contraction_bars,
    ratios,
    ridge,
    spectra,
)
from bayes_hw.report.identifiability.figures_profile import ProfilePanel, nuisance_paths, profiles
from bayes_hw.report.page.palette import VERMILLION


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def test_ridge_names_axes_and_what_is_known(rng, labels_of):
    along = 0.15 * rng.standard_normal(500)
    line = np.linspace(-1, 1, 20)
    panel = RidgePanel(
        "c₁",
        "s₊ (deg/s)",
        along,
        along,
        np.stack([line, line], axis=1),
        np.zeros(2),
        np.full(2, 0.3),
        "s₊ / c₁",
    )
    labels = labels_of(lambda: ridge([panel] * 4))
    assert {"c₁", "s₊ (deg/s)", "known: s₊ / c₁", "orbit: same output everywhere"} <= set(labels)


@pytest.mark.usefixtures("wide_only")
def test_contraction_marks_pooled_priors_for_raw_parameters_only(labels_of):
    rows = [ContractionRow("c₁", 0.73, 0.75), ContractionRow("c₃ / c₂", 0.9999, None)]
    assert {"c₁", "c₃ / c₂"} <= set(labels_of(lambda: contraction_bars(rows)))
    raw, kept = contraction_bars(rows[:1]).svg, contraction_bars(rows[1:]).svg
    assert raw != kept


@pytest.mark.slow
def test_flat_directions_have_their_own_colour_in_a_spectrum():
    quiet = spectra([SpectrumPanel("paper", np.array([1e4, 20.0]), 0)])
    loud = spectra([SpectrumPanel("all free", np.array([1e4, 0.0]), 1)])
    assert loud.svg.lower().count(VERMILLION.lower()) > quiet.svg.lower().count(VERMILLION.lower())


def test_ratios_show_prior_and_one(rng, labels_of):
    draws = rng.normal(1.1, 0.02, 2000)
    panel = RatioPanel("c₃ / c₂", draws, lambda x: np.exp(-x), (1.06, 1.14), "[1.06, 1.14]")
    labels = labels_of(lambda: ratios([panel], "prior of log sd 0.2"))
    assert {"c₃ / c₂", "[1.06, 1.14]", "prior of log sd 0.2", "the paper's assumption"} <= set(labels)


@pytest.fixture
def panel():
    values = np.linspace(0.9, 1.1, 9)
    level = -300 * (values - 1) ** 2
    paths = np.stack([values - 1, 1 - values], axis=1)
    return ProfilePanel("gain", "", values, level, paths, ("δ", "f₁"), np.zeros(9), 1.0, "")


@pytest.mark.usefixtures("wide_only")
def test_open_profiles_are_coloured(panel, labels_of):
    opened = replace(panel, open_sides="open", label="upper saturation limit", unit="deg/s")
    assert profiles([opened], 1.92).svg.lower().count(VERMILLION.lower()) > profiles(
        [panel], 1.92
    ).svg.lower().count(VERMILLION.lower())
    labels = labels_of(lambda: profiles([panel, opened], 1.92))
    assert "gain" in labels
    assert "95 % threshold" in labels


def test_paths_name_every_other_parameter(panel, labels_of):
    assert {"δ", "f₁"} <= set(labels_of(lambda: nuisance_paths([panel])))


@pytest.mark.usefixtures("wide_only")
def test_command_is_drawn_with_its_limits(labels_of):
    t = np.arange(100) / 20
    u = np.sin(t)
    played = PlayedCommand(
        t, u, np.stack([u, 1.1 * u]), 1.5, (-2, 2), ((-0.9, -0.7), (0.8, 1.2)), "deg/s", "deg"
    )
    labels = labels_of(lambda: command(played, "plain sweep"))
    assert {"command (deg/s)", "output (deg)", "time (s)", "allowed"} <= set(labels)
    assert "plain sweep" in command(played, "plain sweep").caption


def test_bars_and_widths_name_their_rows(labels_of):
    bars = [GainBar("plain sweep", 12.0, 0.2, True), GainBar("again", 2.0, 0.1, False)]
    assert {"plain sweep", "again"} <= set(labels_of(lambda: gains(bars)))
    rows = [
        WidthRow("gain of G", 0.2, 0.1, 0.4),
        WidthRow("dead-zone half width", 0.7, 0.6, 0.8, (0.7, 0.72)),
    ]
    labels = labels_of(lambda: widths(rows))
    assert {"gain of G", "dead-zone half width", "obtained"} <= set(labels)
    assert "obtained" not in labels_of(lambda: widths(rows[:1]))


def test_a_missed_width_is_coloured():
    good = CheckRow("gain", (0.95, 1.02), 0.98)
    bad = replace(good, mean=1.4)
    assert VERMILLION.lower() not in width_check([good], 0.2).svg.lower()
    assert VERMILLION.lower() in width_check([bad], 0.2).svg.lower()
