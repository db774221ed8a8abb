"""What is said of a known input, against normals and covariances worked out apart."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from joint_axis import CASCADE, RATE, SIGMA, STRUCTURE, record, scale

from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.known_verdict import doubtful, known_verdict
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior.joint_posterior import INFLATION, JointPosterior
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.gap.joint.search.known_input import ASKED_NATS, READING, KnownInput, forms_of
from bayes_hw.identify.growth.descent import evaluate, triangular_factor
from bayes_hw.record import Record

SAMPLES, GAIN, LAG = 500, 0.02, 3.0


@pytest.fixture(scope="module")
def with_column() -> tuple[JointFit, JointFit]:
    """A fit with a column at the encoder and the one without."""
    effect = Effect(forms_of("temperature")[1], np.array([GAIN, LAG]))
    column = np.sin(np.arange(SAMPLES) / 25.0)
    values = JointValues(CASCADE, (effect,))
    blank = replace(
        record(np.zeros(SAMPLES), 1), known={"temperature": column}, known_units={"temperature": "K"}
    )
    axis = JointResponse(STRUCTURE, (effect,), (), scale(SAMPLES))
    noise = SIGMA * np.random.default_rng(4).standard_normal(SAMPLES)
    shown = replace(blank, y=axis.simulate(values, blank.u, blank.known).y + noise)
    response = JointResponse(STRUCTURE, (effect,), [shown], scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(values))).descended()
    plain = JointResponse(STRUCTURE, (), [shown], scale(SAMPLES))
    return fit, JointFit(plain, evaluate(plain, plain.coordinates(JointValues(CASCADE))))


def _told(fits: tuple[JointFit, JointFit], accepted: bool = True) -> dict[str, dict[str, object]]:
    fit, without = fits
    one = KnownInput(
        "temperature", READING, 80.0 if accepted else 15.0, accepted, without if accepted else None
    )
    found = JointAnswer(fit, fit, {}, {}, read_faults(fit), remainder_of(fit), known=(one,))
    posterior = JointPosterior(fit, np.zeros((0, fit.response.size)), {}, {}, {}, ())
    train = tuple(fit.response.records)

    def close_on(records: tuple[Record, ...], before: JointFit, after: JointFit) -> Closure:
        assert (before, after) == (without, fit)
        closed = 0.9 if records is train else 0.7
        return Closure(2.0, 1.0, 0.5, closed, (0.6, 0.8))

    return known_verdict(found, posterior, train, (), close_on)  # type: ignore[arg-type]


def test_gain_and_lag_are_as_sure_as_the_records_leave_them(with_column: tuple[JointFit, JointFit]) -> None:
    told, fit = _told(with_column)["temperature"], with_column[0]
    factor = triangular_factor(fit.response, fit.point)
    covariance = np.linalg.inv(factor[:-1, :-1].T @ factor[:-1, :-1]) * fit.point.variance_by(factor)
    at = fit.response.size - 2
    gain, lag = (cast("dict[str, object]", told[name]) for name in ("gain", "lag_s"))
    assert gain["mean"] == pytest.approx(fit.values.effects[0].values[0], rel=1e-6)
    assert gain["mean"] == pytest.approx(GAIN, abs=4 * np.sqrt(covariance[at, at]))
    assert gain["sd"] == pytest.approx(INFLATION * np.sqrt(covariance[at, at]), rel=0.01)
    assert lag["mean"] == pytest.approx(fit.values.effects[0].values[1] / RATE, rel=1e-6)
    assert lag["sd"] == pytest.approx(INFLATION * np.sqrt(covariance[at + 1, at + 1]) / RATE, rel=0.01)
    assert (gain["unit"], lag["unit"]) == ("deg/(K)", "s")


def test_a_column_that_the_gap_follows(with_column: tuple[JointFit, JointFit]) -> None:
    told = _told(with_column)["temperature"]
    calibration = JointCalibration.built_in()
    assert told["follows"] is True and told["block"] == "sensor" and told["way"] == READING
    assert told["probability"] == calibration.sure(80.0, calibration.floor)
    gap = cast("dict[str, dict[str, object]]", told["gap"])
    assert (gap["train"]["closed"], gap["holdout"]["closed"]) == (0.9, 0.7)
    assert "70 % (60 to 80 %) of the avoidable error" in str(told["sentence"])


def test_one_that_falls_short_has_what_its_nats_leave(with_column: tuple[JointFit, JointFit]) -> None:
    told = _told(with_column, accepted=False)["temperature"]
    assert told == {"follows": False, "probability": doubtful(15.0), "nats": 15.0}
    assert doubtful(ASKED_NATS - 10) == pytest.approx(0.3 / np.e)
    assert doubtful(ASKED_NATS) == doubtful(ASKED_NATS + 5) == pytest.approx(0.3)
