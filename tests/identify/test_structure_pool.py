"""The weights of the structures visited, and which of them is taken."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.structure_pool import LISTED, NOTHING, Kept, pool_of

BASE = Structure(2, integrator=True, real_poles=0, sections=2, lower=True, upper=True, dead_zone=True)


@dataclass(frozen=True, eq=False)
class Fit:
    """As much of a fitted cascade as is weighed."""

    structure: Structure
    log_likelihood: float
    parameters: int


def fit(sections: int, log_likelihood: float, parameters: int) -> Any:
    return Fit(replace(BASE, sections=sections), log_likelihood, parameters)


def test_weights_are_likelihood_less_parameters_of_the_best_of_each_structure() -> None:
    small, worse, large = fit(1, 100.0, 8), fit(1, 90.0, 8), fit(2, 106.0, 12)
    pool = pool_of([small, worse, large], small, NOTHING)
    assert pool.visited == 2 and [member.order for member in pool.members] == [5, 3]
    assert pool.members[0].weight / pool.members[1].weight == pytest.approx(np.exp(2.0))
    assert sum(member.weight for member in pool.members) == pytest.approx(1.0)
    assert pool.chosen.order == 3 and "order 5" in pool.sentence
    assert "% of their weights" in pool.sentence
    content = pool.to_dict()
    assert content["pool"][0]["blocks"] == ["lower limit", "upper limit", "dead zone"]
    assert content["visited"] == 2
    assert {member.delay_samples for member in pool.members} == {2}
    assert {member.delay_samples for member in pool_of([small, large], small, NOTHING, 10).members} == {20}


def test_poles_that_were_added_are_said_and_the_chosen_one_is_always_listed() -> None:
    others = [fit(number, 500.0 + number, 10) for number in range(3, 3 + LISTED + 4)]
    chosen = fit(2, 400.0, 9)
    pool = pool_of(others, chosen, Kept(2, 2))
    assert len(pool.members) == LISTED + 1 and pool.chosen.weight < 1e-20
    assert "of their weights" not in pool.sentence and "most weight" in pool.sentence
    assert "2 slow real poles" in pool.sentence and "cannot exclude" in pool.sentence
    assert "2 fast real poles" in pool.sentence and pool.to_dict()["pool"][-1]["onset_poles_added"] == 2


def test_it_is_said_what_the_intervals_rest_on() -> None:
    one = fit(1, 100.0, 8)
    plain, guarded = pool_of([one], one, NOTHING), pool_of([one], fit(2, 101.0, 12), Kept(1, 2))
    assert "rest on this one structure" in plain.to_dict()["basis"]
    assert "with nothing added" in plain.basis and "nothing is averaged over the pool" in plain.basis
    assert "guarded by 3 poles" in guarded.basis
