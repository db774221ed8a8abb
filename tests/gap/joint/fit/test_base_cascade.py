"""The cascade that the joint search begins at is not one whose noise took up what the axis does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, STRUCTURE, measured
from series_axis import DELAY, RATE, series
from series_axis import STRUCTURE as SERIES

from bayes_hw.gap.joint.fit import base_cascade
from bayes_hw.gap.joint.fit.base_cascade import grown_base, natural_scale
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior.joint_posterior import laplace
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.growth.descent import triangular_factor
from bayes_hw.identify.growth.search import Grown, smallest_cascade
from bayes_hw.record import Record, Units


@pytest.mark.parametrize("hides", [True, False])
def test_where_noise_hides_a_misfit_a_cascade_on_plain_residuals_goes_on(
    hides: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The growth under coloured noise made to stop at an integrator: it is left where its noise is too large
    for its innovations, and stays where that is not so."""
    records, grown = measured((), 1200, (1, 2)), base_cascade._grown

    def stopped(r: Sequence[Record], structure: Structure, level: float, most_noise: int) -> Grown:
        if most_noise:
            return smallest_cascade(r, structure, level, most_noise).descended()
        return grown(r, structure, level, most_noise)

    smallest = replace(STRUCTURE, sections=0, delay_samples=0)
    poor = stopped(records, smallest, SIGMA, 12)
    assert poor.structure.order < STRUCTURE.order
    monkeypatch.setattr(base_cascade, "_grown", stopped)
    monkeypatch.setattr(base_cascade, "absorbed", lambda _: hides)
    base = grown_base(records, SIGMA)
    assert (base.point.rms < 1.1 * SIGMA) == hides
    assert (base.structure.order >= STRUCTURE.order) == hides


@pytest.fixture(scope="module")
def oversampled() -> JointFit:
    """The base of one record of a slow axis at a high rate, under a sweep that the limits clip: modes of 2.6
    and 4.9 Hz behind a delay, one behind the other."""
    samples, rng = 24_000, np.random.default_rng(3)
    t = np.arange(samples) / RATE
    up = np.linspace(0.05, 8.0, samples // 2)
    u = 0.55 * np.sin(2 * np.pi * np.cumsum(np.concatenate([up, up[::-1]])) / RATE)
    blank = Record("sweep", t, u, np.zeros(samples), RATE, Units())
    y = -Grown.at(SERIES, series(False, 1), [blank], 0).point.residuals[0] + 0.004 * rng.standard_normal(
        samples
    )
    return grown_base([replace(blank, y=y)], 0.004)


def test_a_slow_axis_at_a_high_rate_is_grown_at_a_lower_one(oversampled: JointFit) -> None:
    """At the full rate its base had four poles and eight samples of delay more."""
    assert (oversampled.structure.order, oversampled.structure.delay_samples) == (5, DELAY)
    assert oversampled.point.rms == pytest.approx(0.004, rel=0.02)


def test_its_limits_are_as_uncertain_as_the_records_leave_them(oversampled: JointFit) -> None:
    """The marginal deviation of all coordinates together, though next to nothing tells their gain."""
    factor = triangular_factor(oversampled.response, oversampled.point)
    variance = oversampled.point.sum_of_squares / oversampled.point.samples
    covariance = np.linalg.inv(factor[:-1, :-1].T @ factor[:-1, :-1]) * variance
    drawn = laplace(oversampled, Units(), np.random.default_rng(1), 1.0).base["saturation.lower"]
    assert np.std(drawn) == pytest.approx(np.sqrt(covariance[0, 0]), rel=0.15)
    assert abs(oversampled.values.cascade.lower + 0.45) < 4 * np.sqrt(covariance[0, 0])


def test_the_travel_of_the_records_is_that_of_all_together() -> None:
    """They begin at the same angle: what one shows of a period the other goes on with."""
    (record,) = measured((), 400, (1,))
    other = replace(record, y=-record.y)
    one, both = (natural_scale(r, (-1.0, 1.0), 1.0, SIGMA).travel for r in ([record], [record, other]))
    assert one == pytest.approx(np.ptp(record.y))
    assert both == pytest.approx(2 * np.abs(record.y).max())
