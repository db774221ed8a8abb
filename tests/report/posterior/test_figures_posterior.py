import matplotlib.figure
import numpy as np
import pytest
from scipy import stats

from bayes_hw.errors import InputError
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.posterior.figures_posterior import (
    Marginal,
    autocorrelation,
    corner_plot,
    priors_and_posteriors,
    traces,
)

NAMES = [parameter_name(n) for n in ("saturation.lower", "gain", "mode1.frequency_hz", "noise.sigma")]
UNITS = ["deg/s", "", "Hz", "<deg> $x"]


@pytest.fixture
def draws():
    return np.random.default_rng(0).normal([-0.3, 0.005, 3.3, 0.01], [0.01, 1e-4, 0.01, 1e-3], (800, 4))


def marginals(draws):
    return [
        Marginal(
            name,
            unit,
            column,
            stats.norm(column.mean(), 0.1).pdf,
            tuple(np.quantile(column, [0.03, 0.97])),
            point_estimate=float(column.mean()),
            truth=float(column[0]),
        )
        for name, unit, column in zip(NAMES, UNITS, draws.T, strict=True)
    ]


@pytest.mark.usefixtures("wide_only")
def test_marginals_name_parameter_unit_and_kind_of_interval(draws, labels_of):
    labels = labels_of(lambda: priors_and_posteriors(marginals(draws)))
    assert {"lower saturation limit", "(deg/s)", "gain of G", "frequency of mode 1 (Hz)"} <= set(labels)
    assert {"noise standard deviation", "(<deg> $x)"} <= set(labels)
    assert {"prior", "posterior", "94\u00a0% HDI", "point estimate", "truth"} <= set(labels)


def test_constant_draws_are_drawn(draws):
    draws[:, 1] = 0.005
    assert priors_and_posteriors(marginals(draws)).svg.startswith("<?xml")


@pytest.mark.slow
def test_corner_states_its_probabilities_and_explains_its_symbols(draws, labels_of):
    hdi = np.quantile(draws, [0.03, 0.97], axis=0).T
    figure = corner_plot(draws, NAMES, UNITS, hdi, draws.mean(axis=0))
    assert corner_plot(draws, NAMES, UNITS, hdi, draws.mean(axis=0)).svg == figure.svg
    assert "50 % and 94\u00a0%" in figure.caption
    assert "f₁ frequency of mode 1" in figure.caption
    labels = labels_of(lambda: corner_plot(draws, NAMES, UNITS, hdi))
    assert {"s₋ (deg/s)", "g", "f₁ (Hz)", "σ (<deg> $x)"} <= set(labels)


def test_corner_refuses_more_parameters_than_stay_legible():
    with pytest.raises(InputError, match="choose at most 8"):
        corner_plot(np.zeros((10, 9)), NAMES, UNITS, np.zeros((9, 2)))


@pytest.mark.slow
def test_traces_show_every_ensemble(draws, labels_of):
    chains = draws.reshape(4, 50, 4, 4)
    labels = labels_of(lambda: traces(chains, NAMES, UNITS))
    assert {f"ensemble {number}" for number in (1, 2, 3, 4)} <= set(labels)
    assert {"frequency of mode 1 (Hz)", "step after burn-in"} <= set(labels)


def test_autocorrelation_prints_each_time(labels_of):
    functions = np.exp(-np.arange(30) / np.array([[3.0], [4.0], [5.0], [6.0]]))
    labels = labels_of(lambda: autocorrelation(functions, np.array([6.1, 8.2, 10.3, 12.4]), NAMES))
    assert {" 6.1", " 8.2", " 10.3", " 12.4"} <= {label.rstrip() for label in labels}
    assert {"lag (steps)", "autocorrelation time τ (steps)", "f₁"} <= set(labels)


def test_unknown_autocorrelation_times_are_said(labels_of):
    functions = np.full((4, 10), np.nan)
    labels = labels_of(lambda: autocorrelation(functions, np.full(4, np.nan), NAMES))
    assert sum(label.strip() == "not known" for label in labels) == 4


def test_corner_draws_a_parameter_that_never_moves(draws):
    draws[:, 1] = 0.005
    hdi = np.quantile(draws, [0.03, 0.97], axis=0).T
    assert corner_plot(draws, NAMES, UNITS, hdi).svg.startswith("<?xml")


def test_corner_labels_do_not_reach_into_the_next_panel(draws, monkeypatch):
    drawn = []
    save = matplotlib.figure.Figure.savefig
    monkeypatch.setattr(
        matplotlib.figure.Figure,
        "savefig",
        lambda self, *a, **k: (drawn.append(self), save(self, *a, **k))[1],
    )
    corner_plot(draws, NAMES, UNITS, np.quantile(draws, [0.03, 0.97], axis=0).T)
    for axes in drawn[0].axes[-4:]:
        low, high = axes.get_xlim()
        shares = [(tick - low) / (high - low) for tick in axes.get_xticks()]
        assert len(shares) >= 2
        assert all(0.09 <= share <= 0.91 for share in shares)
