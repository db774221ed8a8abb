"""Poles and gains of a printed model are drawn with everything that the captions speak of."""

import numpy as np
import pytest
from pages.figures_printed_model import PoleClouds, pole_map, velocity_gain_band


@pytest.mark.usefixtures("wide_only")
def test_pole_map_names_its_clouds(labels_of):
    pair = np.array([0.5 + 0.83j, 0.5 - 0.83j])
    kept = np.concatenate([[1.0, 0.99], pair])
    rng = np.random.default_rng(1)
    box = kept + 0.01 * rng.normal(size=(20, 4))
    printed = kept + np.array([0.05, 0, 0, 0])
    labels = labels_of(lambda: pole_map(PoleClouds(box, box[:, 1:], printed, kept)))
    assert {"whole box", "stable integrators", "as printed", "representative", "unit circle"} <= set(labels)
    assert {"real part of z", "imaginary part", "near z = 1", "resonances"} <= set(labels)


@pytest.mark.usefixtures("wide_only")
def test_velocity_gain_has_its_unit(labels_of):
    frequency = np.geomspace(0.01, 1, 20)
    curves = np.exp(np.random.default_rng(2).normal(size=(50, 20)))
    labels = labels_of(lambda: velocity_gain_band(frequency, curves, curves[0], "deg/s/V"))
    assert "velocity gain (deg/s/V)" in labels
    assert {"94\u00a0%", "all members", "median", "representative"} <= set(labels)
