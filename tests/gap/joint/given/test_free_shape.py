"""A local error of the reading is found as a function of position; what has a name costs less by its name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import SIGMA, command, form, measured, model, record, response_with

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.decision.given_decision import GivenEvidence, decide_given
from bayes_hw.gap.joint.given import given_rivals, given_search
from bayes_hw.gap.joint.given.free_shape import free_shape
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_model import STATIC
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_rivals import instead_of
from bayes_hw.gap.joint.given.given_search import search_given
from bayes_hw.gap.joint.given.given_trail import Trail
from bayes_hw.gap.joint.residuals import beside_fit
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.identify.growth.descent import triangular_factor
from bayes_hw.record import Record

SAMPLES = 700


def with_tooth(records: list[Record]) -> list[Record]:
    """Readings that err by eight times the noise near one angle that they pass often."""
    joined = np.concatenate([r.y for r in records])
    at, width = np.quantile(joined, 0.7), 0.15 * np.std(joined)
    return [replace(r, y=r.y + 8 * SIGMA * np.exp(-(((r.y - at) / width) ** 2))) for r in records]


@pytest.fixture(scope="module")
def toothed() -> GivenFit:
    """The base under records with a tooth."""
    return best_base(with_tooth(measured((), SAMPLES, (1, 2, 3))), model())


@pytest.fixture(scope="module")
def quiet() -> GivenFit:
    """The base under records of nothing but noise."""
    return best_base(measured((), SAMPLES, (1, 2)), model())


@pytest.fixture(scope="module")
def untoothed(toothed: GivenFit) -> GivenFit:
    """The tooth as a function of position."""
    return free_shape(toothed)


def test_a_tooth_is_taken_out_and_the_base_held(toothed: GivenFit, untoothed: GivenFit) -> None:
    base, shaped = toothed, untoothed
    assert not shaped.slides
    assert shaped.score > base.score + 100
    assert shaped.point.rms == pytest.approx(SIGMA, rel=0.2)
    assert shaped.values.cascade.upper == pytest.approx(0.3, rel=0.02)


def slid(seeds: tuple[int, ...]) -> list[Record]:
    """Readings of a disc that slides by three times the noise where its shaft accelerates hardest."""
    response, values = response_with((), SAMPLES)
    found = []
    for seed in seeds:
        w = response.simulate(values, command(SAMPLES, seed)).w
        a = np.gradient(np.gradient(w))
        hard = np.abs(a) > np.quantile(np.abs(a), 0.99)
        w = w - 3 * SIGMA * np.cumsum(np.where(hard, np.sign(a), 0.0))
        noise = SIGMA * np.random.default_rng(seed + 100).standard_normal(SAMPLES)
        half = values.cascade.half_width
        found.append(record(w - np.clip(w, -half, half) + noise, seed))
    return found


@pytest.mark.slow
def test_a_disc_that_slides_is_told_from_a_function_of_position() -> None:
    base = best_base(slid((1, 2)), model())
    shaped = free_shape(base)
    assert shaped.slides
    assert shaped.factor().shape == (shaped.response.size + 1,) * 2
    assert shaped.score > base.score + 100
    assert shaped.point.rms == pytest.approx(SIGMA, rel=0.2)
    assert shaped.values.cascade.upper == pytest.approx(0.3, rel=0.02)


def test_nothing_is_worth_no_shape(quiet: GivenFit) -> None:
    assert free_shape(quiet).score < quiet.score - 20


@pytest.mark.slow
def test_a_tooth_has_no_name(toothed: GivenFit, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside an explanation that is worth less, it is the answer, with what else was tried."""
    base = toothed
    weak = base.with_effect(form("gain_asymmetry"), (0.0,)).descended()
    trail = Trail(weak, base, base, read_faults(base), {"gain_asymmetry": 30.0}, {})  # type: ignore[arg-type]
    monkeypatch.setattr(given_search, "_extended", lambda *_: trail)
    monkeypatch.setattr(given_search, "verified", lambda *_: (weak, {"gain_asymmetry": 30.0}))
    monkeypatch.setattr(given_rivals, "every_law", lambda *_: [])
    found = search_given(base.response.records, model())
    assert set(found.nats) == {"other"}
    assert set(found.ends) == {"gain_asymmetry", "other"}
    said = decide_given(GivenEvidence.of(found, SIGMA))
    assert said.answer == ("other",)


@pytest.mark.slow
def test_gains_that_differ_keep_their_name_beside_any_shape() -> None:
    """Whatever else is said in place of it is worth less than nothing, by what it costs."""
    uneven = Effect(form("gain_asymmetry"), np.array([0.12]))
    base = best_base(measured((uneven,), SAMPLES, (1, 2)), model())
    fit = base.with_effect(form("gain_asymmetry"), (0.0,)).descended()
    own = fit.score - base.score
    ends = instead_of(fit, base, {"gain_asymmetry": own}, {"gain_asymmetry": own}, {})  # type: ignore[arg-type]
    assert ends["gain_asymmetry"] is fit
    assert fit.score > ends["other"].score
    assert base.score - 20 > ends["other"].score
    assert instead_of(fit, base, {"wind": own}, {}, {}) == {}  # type: ignore[arg-type]


@pytest.mark.slow
def test_where_nothing_was_found_a_function_of_position_still_is(toothed: GivenFit, quiet: GivenFit) -> None:
    ends = instead_of(toothed, toothed, {}, {}, {})
    assert set(ends) == {"other"}
    assert ends["other"].score > toothed.score + 50
    assert instead_of(quiet, quiet, {}, {}, {}) == {}


def test_what_a_function_takes_up_the_records_do_not_tell_of_the_gain(untoothed: GivenFit) -> None:
    """A straight line over position is nearly a gain."""
    shaped = untoothed
    alone = triangular_factor(shaped.response, shaped.point)
    assert gain_sd(shaped, shaped.factor()) > 2 * gain_sd(shaped, alone)


def gain_sd(fit: GivenFit, factor: FloatArray) -> float:
    """Standard deviation of the logarithm of the gain by a triangular factor (size + 1, size + 1)."""
    precision = factor[:-1, :-1].T @ factor[:-1, :-1] / (factor[-1, -1] ** 2 / fit.point.samples)
    return float(np.sqrt(np.linalg.inv(precision)[STATIC - 1, STATIC - 1]))


def test_derivatives_that_overflow_tell_no_shape(quiet: GivenFit, monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a motion that grows over the record: no number, and no error."""
    rows = np.full((quiet.response.size + 2, SAMPLES), np.inf)
    monkeypatch.setattr(beside_fit, "whitened_columns", lambda *_: [rows, rows])
    columns = [np.ones((1, SAMPLES))] * 2
    with np.errstate(all="ignore"):
        found = beside_fit.best_coefficients(quiet, quiet, columns, quiet.point.whitener)
    assert found.shape == (1,) and np.isnan(found).all()
