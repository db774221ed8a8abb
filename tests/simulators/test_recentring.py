"""Fits on a simulator that its linear axis does not follow: a torque limit that the axis often meets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_axis import DECLARED, DECLARED_LOOP, TORQUE_MOTOR, commands, record, write_mjcf

pytest.importorskip("mujoco")

from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.gap.search.question import Question, question
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.simulators.mjcf_axis import MjcfAxis
from bayes_hw.simulators.recentring import RecentredHypothesis, Recentring
from bayes_hw.simulators.simulator_diagnosis import open_simulator, simulator_case
from bayes_hw.time_budget import at_most

SIGMA, SAMPLES, OFF = 0.002, 700, 1.1
LIMIT = 0.5
"""N m: a quarter of what the loop asks for at a usual change of the command."""


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> tuple[MjcfAxis, Question]:
    """The axis, and the question about records of it with other parameters."""
    declared = DECLARED.replace('"rate", "hold"', '"torque"') + DECLARED_LOOP.replace("1000.0", str(LIMIT))
    axis = open_simulator(write_mjcf(tmp_path_factory.mktemp("limit"), TORQUE_MOTOR, declared))
    assert isinstance(axis, MjcfAxis)
    rng = np.random.default_rng(3)
    true = np.array([[OFF * parameter.nominal for parameter in axis.parameters]])
    records = []
    for name in ("a", "b"):
        u = commands(rng, SAMPLES)
        y = axis.simulate(true, u)[0] + SIGMA * rng.standard_normal(SAMPLES)
        records.append(record(name, u, y))
    case, _ = simulator_case(axis, records[:1], records[1:])
    return axis, question(case, frozenset())


@pytest.mark.compiles("chains")
def test_the_base_is_moved_by_what_the_linear_axis_lacks(asked: tuple[MjcfAxis, Question]) -> None:
    axis, about = asked
    moved = Recentring(axis, Each()).posed(about).base
    assert isinstance(moved, RecentredHypothesis)
    assert moved.centre is not None
    at = moved.centre
    (full,) = axis.simulate(at[None], moved.inputs[0])
    (linear,) = axis.linear.simulate(at[None], moved.inputs[0])
    assert np.abs(full - linear).max() > 50 * SIGMA
    np.testing.assert_allclose(moved.simulate(at)[0], full, atol=1e-12)
    (w, y) = moved.simulate_signals(at)[0]
    np.testing.assert_allclose(w, full, atol=1e-12)
    np.testing.assert_allclose(y, full, atol=1e-12)
    other = about.base.inputs[0][::-1].copy()
    np.testing.assert_allclose(moved.simulate(at, [other])[0], axis.simulate(at[None], other)[0], atol=1e-12)


@pytest.mark.slow
def test_an_explanation_ends_where_the_simulator_itself_fits(asked: tuple[MjcfAxis, Question]) -> None:
    """The linear axis alone leaves many times the noise, which then passes for a slow one."""
    axis, about = asked
    full = Recentring(axis, Each())
    alone = fit(about.base, about.measured, about.base.prior_means, Plain(SIGMA))
    assert alone.rmse > 10 * SIGMA
    first = with_coloured_noise(alone, about.measured)
    refined = full.refined(about, Attribution(first, (first,), (alone.cost,), ())).base
    assert refined.fit.rmse < 1.1 * SIGMA
    at = refined.fit.values
    shown = axis.simulate(at[None], about.base.inputs[0])[0]
    np.testing.assert_allclose(refined.fit.simulated[0], shown, atol=1e-12)
    sds = np.sqrt(np.diag(refined.fit.covariance()))
    true = np.log(OFF * np.array([parameter.nominal for parameter in axis.parameters]))
    assert np.all(np.abs(refined.fit.coordinates - true) < 4 * sds)
    assert refined.log_evidence > first.log_evidence


def test_out_of_time_only_the_base_is_fitted_on_the_full_simulator(
    asked: tuple[MjcfAxis, Question], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is left stays as the linear axis has it, and the answer is said to be cut short."""
    axis, about = asked
    first = with_coloured_noise(
        fit(about.base, about.measured, about.base.prior_means, Plain(SIGMA)), about.measured
    )
    other = replace(first, fit=fit(about.base, about.measured, about.base.prior_means + 0.01, Plain(SIGMA)))
    tried: list[Explanation] = []

    def noted(_: Recentring, one: Explanation, measured: object) -> Explanation:  # noqa: ARG001
        tried.append(one)
        return one

    monkeypatch.setattr(Recentring, "_fitted", noted)
    for seconds, cut_short in ((0.0, True), (60.0, False)):
        tried.clear()
        with at_most(seconds):
            found = Recentring(axis, Each()).refined(about, Attribution(first, (other,), (0.0,), ()))
        assert found.cut_short == cut_short
        assert tried == ([first] if cut_short else [first, other])


def test_without_a_full_simulator_nothing_is_moved(asked: tuple[MjcfAxis, Question]) -> None:
    base = asked[1].base
    same = RecentredHypothesis(base.builder, base.scale, base.inputs)
    at = base.to_values(base.prior_means)
    np.testing.assert_array_equal(same.simulate(at)[0], base.simulate(at)[0])
    assert isinstance(same.with_effect(asked[1].effects[0]), RecentredHypothesis)


def test_a_urdf_needs_no_actuator(tmp_path: Path) -> None:
    """Torque of the loop on a joint, the same as through an actuator."""
    through = DECLARED.replace('"rate", "hold"', '"torque"') + DECLARED_LOOP
    straight = DECLARED.replace('actuators = ["rate", "hold"]', "") + DECLARED_LOOP + 'torque_on = "motor"\n'
    found = []
    for name, declared in (("through", through), ("straight", straight)):
        folder = tmp_path / name
        folder.mkdir()
        axis = open_simulator(write_mjcf(folder, TORQUE_MOTOR, declared))
        at = np.array([[parameter.nominal for parameter in axis.parameters]])
        found.append(axis.simulate(at, commands(np.random.default_rng(1), 500)))
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)
