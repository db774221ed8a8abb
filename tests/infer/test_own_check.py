"""The check of the intervals on the user's own axis: what is simulated, compared and counted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from scipy import stats
from spread_axis import spread_posterior

from bayes_hw.executor import LocalExecutor
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer import own_check
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.own_check import Held, OwnCheck, check_own_axis, check_tasks, true_values
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.record import Record, Units

RECORD = Record("r", np.arange(400) / 20.0, 0.3 * np.sin(np.arange(400) / 9.0), np.zeros(400), 20.0, Units())


def test_the_interval_of_a_share_is_the_exact_one() -> None:
    low, high = Held(19, 20).interval95
    assert low == pytest.approx(0.7513, abs=1e-4) and high == pytest.approx(0.9987, abs=1e-4)


def test_replicates_are_simulated_with_the_values_that_they_are_held_against() -> None:
    """Each draw's own model and noise: what is left after its response has the draw's standard deviation."""
    posterior = spread_posterior(nanshan_model(0.006, 0.002), "conditional", spread=0.01)
    tasks = check_tasks(posterior, [RECORD], 3, 1, SamplerSettings())
    assert len({task[1]["saturation.upper"] for task in tasks}) == 3
    for (simulated,), truth, _, _ in tasks:
        np.testing.assert_array_equal(simulated.u, RECORD.u)
        assert truth["saturation.upper"] == pytest.approx(0.438, rel=0.05)
        assert 0.0005 < np.std(np.diff(simulated.y - posterior.mean_model().simulate(RECORD.u).y)) < 0.02
    again = check_tasks(posterior, [RECORD], 3, 1, SamplerSettings())
    np.testing.assert_array_equal(again[2][0][0].y, tasks[2][0][0].y)


def test_counts_are_those_of_the_replicates() -> None:
    posterior = spread_posterior(nanshan_model(0.006, 0.002), "conditional", spread=0.01)
    truth = true_values(posterior.mean_model())

    class Pretended(LocalExecutor):
        def map(self, function: Any, tasks: Any, **options: Any) -> list[Any]:
            assert "kept" in options and function is own_check.check_once and len(tasks) == 4
            return [
                {"inside": dict.fromkeys(truth, number != 0), "converged": number != 3} for number in range(4)
            ]

    found = check_own_axis(posterior, [RECORD], 4, 1, Pretended())
    assert (found.replicates, found.converged) == (4, 3)
    assert set(found.held) == set(truth) and all(one == Held(3, 4) for one in found.held.values())
    assert found.all_parameters == Held(3 * len(truth), 4 * len(truth))
    assert found.to_dict()["held"]["saturation.lower"]["held"] == 3
    assert isinstance(found, OwnCheck)


def test_more_replicates_begin_with_the_same_ones() -> None:
    """So that a check goes on from what is kept when more are asked for."""
    posterior = spread_posterior(nanshan_model(0.006, 0.002), "conditional", spread=0.01)
    few, more = (check_tasks(posterior, [RECORD], n, 1, SamplerSettings()) for n in (2, 5))
    for one, same in zip(few, more[:2], strict=True):
        np.testing.assert_array_equal(one[0][0].y, same[0][0].y)
        assert one[1:] == same[1:]
    assert more[3][1] != more[4][1]


def test_a_parameter_is_refuted_where_chance_does_not_explain_its_misses() -> None:
    often, seldom = Held(18, 20), Held(14, 20)
    assert OwnCheck(20, 20, {"a": often, "b": often}).stands
    check = OwnCheck(20, 20, {"a": often, "b": seldom, "c": often})
    assert check.refuted == ("b",) and not check.stands and check.to_dict()["stands"] is False
    assert not OwnCheck(5, 5, {"a": Held(5, 5)}).stands
    assert seldom.p_value == pytest.approx(0.00087, rel=0.05)


def test_replicates_have_the_tails_of_the_draws() -> None:
    """Student-t noise is simulated with the degrees of freedom, and the standard deviation, of the draw."""
    posterior = spread_posterior(nanshan_model(0.006, 0.002), "conditional", spread=0.01)
    estimate = NoiseEstimate(0.01, np.zeros(0), degrees_of_freedom=4.0)
    noise = noise_parameters(estimate, "deg")
    n_axis = len(posterior.axis.parameters)
    values = np.concatenate(
        [posterior.values[..., :n_axis], np.broadcast_to([0.01, 4.0], (*posterior.values.shape[:-1], 2))],
        axis=-1,
    )
    heavy = replace(posterior, noise_parameters=noise, values=values, point_estimate=values[0, 0, 0])
    long = replace(RECORD, t=np.arange(20000) / 20.0, u=np.zeros(20000), y=np.zeros(20000))
    (((simulated,), _, _, _),) = check_tasks(heavy, [long], 1, 1, SamplerSettings())
    assert np.std(simulated.y) == pytest.approx(0.01, rel=0.1)
    assert stats.t.fit(simulated.y, floc=0.0)[0] == pytest.approx(4.0, rel=0.15)
