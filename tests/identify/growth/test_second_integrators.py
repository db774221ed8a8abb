"""A pole that no record tells from the integrator is one with it; the response within records stays."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_basis import linear_basis
from bayes_hw.identify.growth.search import Grown
from bayes_hw.identify.growth.slow_poles import joined_to_integrator, slow_poles, with_one_integrator
from bayes_hw.record import Record, Units

SAMPLES = 600
NEARLY = 1 - 1e-7


def cascade(real: list[list[float]], sections: list[list[float]]) -> tuple[Structure, CascadeValues]:
    poles, sos = np.array(real, float).reshape(2, -1), np.array(sections, float).reshape(4, -1)
    structure = Structure(1, True, poles.shape[1], sos.shape[1])
    return structure, CascadeValues(
        -np.inf, np.inf, 0.0, 0.0, 2.6, poles, sos, np.zeros((1, structure.order))
    )


def response(structure: Structure, values: CascadeValues) -> np.ndarray:
    impulse = np.concatenate([[1.0], np.zeros(SAMPLES - 1)])
    weights = [values.integrator_residue, *values.real[1], *values.sections[2:].T.ravel()]
    return np.array(weights) @ linear_basis(structure, values, [impulse])[0]


@pytest.mark.parametrize(
    ("real", "sections", "order"),
    [
        ([[NEARLY, 0.4], [-2.5, 0.3]], [], 2),
        ([[0.4], [0.3]], [[NEARLY - 1.0], [-NEARLY], [0.7], [0.8]], 3),
        ([[0.4], [0.3]], [[NEARLY + 0.5], [NEARLY * 0.5], [0.7], [-0.1]], 3),
    ],
    ids=["real pole", "beside Nyquist", "in a section"],
)
def test_the_response_stays(real: list[list[float]], sections: list[list[float]], order: int) -> None:
    structure, values = cascade(real, sections)
    smaller, joined = joined_to_integrator(structure, values, SAMPLES)
    assert smaller.order == order
    before, after = response(structure, values), response(smaller, joined)
    np.testing.assert_allclose(after, before, atol=1e-3 * np.abs(before).max())


def test_what_records_tell_from_an_integrator_stays() -> None:
    structure, values = cascade([[0.999, 0.4], [-0.5, 0.3]], [[1.9], [0.95], [0.1], [0.1]])
    assert joined_to_integrator(structure, values, SAMPLES) == (structure, values)


def test_the_gain_is_the_one_that_records_show() -> None:
    """A second integrator of the opposite sign leaves a velocity gain sixteen times too large."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(0, 1, SAMPLES // 20), 20)
    y = 0.1 * np.concatenate([[0.0, 0.0], np.cumsum(u)[:-2]]) + 0.01 * rng.standard_normal(SAMPLES)
    record = Record("r", np.arange(SAMPLES) / 20, u, y, 20.0, Units())
    structure, values = cascade([[NEARLY], [-2.5]], [])
    item = Grown.at(structure, values, [record]).descended()
    assert slow_poles(item) == 0
    found = with_one_integrator(item)
    assert found.structure.order == 1
    assert found.values.integrator_residue == pytest.approx(0.1, rel=0.01)
    assert found.criterion < item.criterion
