import numpy as np
import pytest

from bayes_hw.report.posterior.figures_identification import (
    ResidualDiagnostics,
    ResponseBand,
    StaticBlock,
    frequency_response,
    residual_diagnostics,
    static_blocks,
    step_results,
)


@pytest.mark.usefixtures("wide_only")
def test_steps_show_cost_fit_and_baseline(labels_of):
    costs, fits = np.array([3e-3, 2e-4]), np.array([86.2, 94.6])
    labels = labels_of(lambda: step_results(["linear", "all"], costs, fits, "deg", 86.2))
    assert {"linear", "all", "rms output error (deg)", "fit (%)"} <= set(labels)
    assert "linear baseline 86.2 %" in labels


def test_a_negative_fit_is_drawn():
    figure = step_results(["linear"], np.array([1.0]), np.array([-30.0]), "deg²")
    assert figure.svg.startswith("<?xml")


@pytest.mark.usefixtures("wide_only")
def test_static_blocks_label_both_axes_of_each_block(labels_of):
    u = np.linspace(-1, 1, 50_001)
    block = StaticBlock("saturation f", u, np.clip(u, -0.3, 0.4), u, u, "u ($deg/s)", "v (deg/s)")
    labels = labels_of(lambda: static_blocks([block, block]))
    assert labels.count("u ($deg/s)") == labels.count("v (deg/s)") == 2
    assert {"rebuilt from the record", "fitted function"} <= set(labels)
    assert len(static_blocks([block, block]).svg) < 400_000


def test_frequency_response_has_magnitude_and_phase_with_units(labels_of):
    f = np.geomspace(0.1, 10, 60)
    g = 0.1 / (2j * np.pi * f)
    decibel, phase = 20 * np.log10(np.abs(g)), np.full(60, -90.0)
    band = ResponseBand("94 % credible band", decibel - 1, decibel + 1, phase - 2, phase + 2)
    labels = labels_of(lambda: frequency_response(f, g, "s", 1.1 * g, band))
    assert {"magnitude (dB, re 1 s)", "phase (deg)", "frequency (Hz)"} <= set(labels)
    assert {"linear baseline", "94 % credible band", "0.1", "1", "10"} <= set(labels)


@pytest.mark.slow
@pytest.mark.usefixtures("wide_only")
def test_residual_tests_label_all_four_panels(labels_of):
    rng = np.random.default_rng(0)
    t = np.arange(2000) / 20
    diagnostics = ResidualDiagnostics(
        t=t,
        residual=rng.normal(size=2000),
        unit="deg",
        autocorrelation=np.r_[1.0, rng.normal(0, 0.02, 20)],
        bound=0.044,
        frequency_hz=np.linspace(0.01, 10, 500),
        density=rng.exponential(size=500),
        white_density=1.0,
        normal_quantiles=np.linspace(-3, 3, 50),
        ordered=np.linspace(-3, 3, 50),
    )
    labels = labels_of(lambda: residual_diagnostics(diagnostics))
    assert {"residual (deg)", "lag (samples)", "power density (deg²/Hz)"} <= set(labels)
    assert {"over time", "autocorrelation", "periodogram", "normal quantiles"} <= set(labels)
    assert "95\u00a0% bounds" in residual_diagnostics(diagnostics).caption
