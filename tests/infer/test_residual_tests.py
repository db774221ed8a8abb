"""The residual tests reject white residuals as rarely as they say, and see what they are meant to see."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal, stats
from simulated_records import coloured_noise, command

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.residual_tests import (
    NORMALITY,
    SIGNIFICANCE,
    STUDENT_T,
    ResidualReport,
    ResidualTest,
    examine_residuals,
)
from bayes_hw.record import Record, Units

WHITE, COMMAND, MAGNITUDE = 0, 1, 2


def record_of(u: FloatArray) -> Record:
    t = np.arange(len(u)) / 20.0
    return Record("test", t, u, np.zeros(len(u)), 20.0, Units())


def examined(
    e: FloatArray, u: FloatArray | None = None, autoregression: tuple[float, ...] = ()
) -> ResidualReport:
    u = command(len(e), np.random.default_rng(99)) if u is None else u
    return examine_residuals([record_of(u)], [e], np.array(autoregression))


def named(report: ResidualReport, name: str) -> ResidualTest:
    return next(test for test in report.tests if test.name == name)


def test_sizes_under_white_residuals() -> None:
    """400 replicates of 500 samples of AR(1) noise whitened by its own coefficient: each rejects as often
    as the binomial distribution allows at 1 % (99.9 % bounds)."""
    rng = np.random.default_rng(1)
    u = command(500, rng)
    rejected = np.zeros(4)
    for _ in range(400):
        report = examined(coloured_noise(500, 1.0, 0.6, rng), u, (0.6,))
        rejected += [not test.passed for test in report.tests]
    low, high = stats.binom.ppf([0.0005, 0.9995], 400, SIGNIFICANCE)
    assert (rejected[:3] >= low).all() and (rejected[:3] <= high).all(), rejected
    assert rejected[3] <= 400 * 0.03, "Jarque-Bera approaches its level slowly from above"


def test_outliers_do_not_hide_what_follows_the_command() -> None:
    """A tenth of the noise follows the command; a hundredth of the samples lie forty deviations off."""
    rng = np.random.default_rng(11)
    u = rng.standard_normal(3000)
    outliers = 40 * rng.standard_normal(3000) * (rng.random(3000) < 0.01)
    e = rng.standard_normal(3000) + 0.1 * u
    assert examined(e + outliers, u).tests[COMMAND].p_value < 1e-4
    assert examined(e - 0.1 * u + outliers, u).tests[COMMAND].passed


@pytest.mark.slow
def test_p_values_of_whiteness_are_uniform() -> None:
    rng = np.random.default_rng(2)
    p_values = [examined(rng.standard_normal(800)).tests[WHITE].p_value for _ in range(200)]
    assert stats.kstest(p_values, stats.uniform.cdf).pvalue > 1e-3


def test_a_long_autoregression_of_few_numbers_is_tested_as_such() -> None:
    """Of a walk on white noise: one number was fitted, forty coefficients follow from it."""
    rng = np.random.default_rng(3)
    phi = 0.7 ** np.arange(1, 41) * 0.3 / 0.7
    u = command(4000, rng)
    e = signal.lfilter([1.0], np.concatenate([[1.0], -phi]), rng.standard_normal(4000))
    few, many = (examine_residuals([record_of(u)], [e], phi, count).tests[WHITE] for count in (1, 40))
    assert few.passed and few.p_value > 0.05
    assert not many.passed


def test_too_low_a_noise_order_is_seen_as_correlation_in_time() -> None:
    """AR(2) noise whitened by the best AR(1)."""
    rng = np.random.default_rng(3)
    e = signal.lfilter([1.0], [1.0, -0.8, 0.4], rng.standard_normal(2000))
    assert not examined(e, autoregression=(0.8 / 1.4,)).tests[WHITE].passed
    assert examined(e, autoregression=(0.8, -0.4)).tests[WHITE].passed


def test_a_missing_mode_is_seen_in_the_command() -> None:
    """A resonance at 3 Hz whose response is as large as the noise."""
    rng = np.random.default_rng(4)
    u = command(1500, rng)
    pole = 0.95 * np.exp(2j * np.pi * 3 / 20)
    response = signal.lfilter([0.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], u)
    e = rng.standard_normal(1500) + response / response.std()
    report = examined(e, u)
    assert not report.tests[COMMAND].passed and "linear dynamics" in report.tests[COMMAND].meaning
    assert not report.white


def test_a_missing_nonlinearity_is_seen_in_the_magnitude_alone() -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal(3000)
    e = rng.standard_normal(3000)
    e[1:] += 0.3 * (np.abs(u[:-1]) - np.sqrt(2 / np.pi))
    report = examined(e, u)
    assert report.tests[COMMAND].passed
    assert not report.tests[MAGNITUDE].passed and "nonlinearity" in report.tests[MAGNITUDE].meaning


@pytest.mark.parametrize("fault", ["outliers", "quantization"])
def test_outliers_and_coarse_quantization_are_not_normal(fault: str) -> None:
    """They leave the structure's tests alone: the report stays white."""
    rng = np.random.default_rng(6)
    e = rng.standard_normal(3000)
    if fault == "outliers":
        e[rng.choice(3000, 15, replace=False)] *= 8
    else:
        e = 4.0 * np.round(e / 4.0) + 0.05 * rng.standard_normal(3000)
    report = examined(e)
    assert not named(report, NORMALITY).passed
    assert report.white


def test_records_are_tested_together_but_never_joined() -> None:
    """Residuals with opposite means in two records are no correlation across their border."""
    rng = np.random.default_rng(7)
    e = [rng.standard_normal(700), rng.standard_normal(500)]
    records = [record_of(command(len(part), rng)) for part in e]
    report = examine_residuals(records, e, np.array([0.0]))
    assert [len(a) for a in report.innovations] == [699, 499]
    assert report.bound == pytest.approx(1.96 / np.sqrt(1198))
    expected = sum(float((a[1:] - a.mean()) @ (a[:-1] - a.mean())) for a in report.innovations)
    expected /= sum(float((a - a.mean()) @ (a - a.mean())) for a in report.innovations)
    assert report.autocorrelation[0] == 1 and report.autocorrelation[1] == pytest.approx(expected)


def test_constant_command_says_nothing() -> None:
    """No division by zero: a command without change cannot correlate."""
    report = examined(np.random.default_rng(8).standard_normal(400), np.full(400, 0.5))
    assert report.tests[COMMAND].passed and report.tests[MAGNITUDE].passed
    assert set(report.to_dict()) == {"fit_percent", "white", "closed_loop", "tests"}
    assert report.to_dict()["closed_loop"] is False


def test_a_model_that_explains_nothing_is_said_to(small_record: Record) -> None:
    """White residuals as large as the output itself do not pass for a model."""
    noise = np.random.default_rng(5).standard_normal(len(small_record))
    for share, explained in ((0.05, True), (1.0, False)):
        residual = share * float(np.std(small_record.y)) * noise
        found = examine_residuals([small_record], [residual], np.zeros(0))
        assert found.explained is explained
        assert found.fit_percent == pytest.approx(100 * (1 - share), abs=5)


@pytest.mark.parametrize(("degrees", "assumed", "passes"), [(4.0, 4.0, True), (4.0, 60.0, False)])
def test_student_t_innovations_are_held_against_their_own_distribution(
    degrees: float, assumed: float, passes: bool
) -> None:
    """Tails of four degrees of freedom pass as what they are, at any scale, and not as nearly normal ones."""
    rng = np.random.default_rng(9)
    e = 0.03 * rng.standard_t(degrees, 4000)
    report = examine_residuals(
        [record_of(command(len(e), rng))], [e], np.zeros(0), degrees_of_freedom=assumed
    )
    assert named(report, STUDENT_T).passed is passes
    assert report.white
    assert not named(examined(e), NORMALITY).passed
