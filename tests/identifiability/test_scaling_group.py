"""v -> a v, w -> b w changes no output, and the invariants are all that it leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.freed_gains import ALL_FREED, ASYMMETRIES, GAIN_POSITIVE, SLOPE, FreedGains
from bayes_hw.identifiability.scaling_group import (
    GENERATORS,
    acting_generators,
    exponent_vector,
    generators,
    invariants,
    log_monomial,
    monomial,
)
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units


def transformed(values: FloatArray, names: Sequence[str], a: float, b: float) -> FloatArray:
    """Values (parameters,) after v -> a v and w -> b w."""
    return np.asarray(values * np.exp(generators(names) @ np.log([a, b])))


@pytest.mark.parametrize("positions", [None, np.array([0.5]), np.array([-0.5])], ids=str)
@pytest.mark.parametrize(("a", "b"), [(3.0, 1.0), (1.0, 0.2), (0.4, 7.0)])
def test_the_group_changes_no_output(
    small_axis: HammersteinWiener, swinging_record: Record, a: float, b: float, positions: np.ndarray | None
) -> None:
    axis = FreedGains(small_axis, start_positions=positions)
    rng = np.random.default_rng(1)
    values = axis.nominal * np.exp(0.2 * rng.standard_normal(len(axis.names)))
    both = np.stack([values, transformed(values, axis.names, a, b)], axis=1)
    before, after = simulated_outputs(axis, both, [swinging_record])[0]
    assert np.ptp(before) > 0.1
    np.testing.assert_allclose(after, before, atol=1e-12)


def test_moving_one_parameter_along_alone_does(
    small_axis: HammersteinWiener, swinging_record: Record
) -> None:
    """The check above can fail: leaving c3 behind changes the output."""
    axis = FreedGains(small_axis)
    moved = transformed(axis.nominal, axis.names, 1.0, 2.0)
    moved[axis.names.index("dead_zone.gain_negative")] *= 2.0
    before, after = simulated_outputs(axis, np.stack([axis.nominal, moved], axis=1), [swinging_record])[0]
    assert np.max(np.abs(after - before)) > 0.01


def test_invariants_are_complete(small_axis: HammersteinWiener) -> None:
    """Each is orthogonal to both generators, and they span all that is: eight parameters less two."""
    names = [name for name in FreedGains(small_axis).names if not name.startswith("mode")]
    powers = np.stack([exponent_vector(i.exponents, names) for i in invariants(Units())])
    np.testing.assert_array_equal(powers @ generators(names), 0)
    assert np.linalg.matrix_rank(powers) == len(names) - 2 == 6


def test_monomials_keep_signs(small_axis: HammersteinWiener) -> None:
    axis = FreedGains(small_axis)
    lower = next(i for i in invariants(Units()) if i.name == "lower/c1")
    values = transformed(axis.nominal, axis.names, 2.0, 3.0)
    assert monomial(lower.exponents, values, axis.names) == pytest.approx(-0.8)
    assert log_monomial(lower.exponents, values, axis.names) == pytest.approx(np.log(0.8))


@pytest.mark.parametrize(
    ("freed", "dimension"),
    [(ALL_FREED, 2), ((SLOPE,), 1), (ASYMMETRIES, 0), ((SLOPE, GAIN_POSITIVE), 1), ((), 0)],
)
def test_holding_gains_breaks_symmetries(
    small_axis: HammersteinWiener, freed: tuple[str, ...], dimension: int
) -> None:
    """c2 alone cannot be rescaled: c3, which is held, would have to follow."""
    names = FreedGains(small_axis, freed).names
    directions = acting_generators(names)
    assert directions.shape == (len(names), dimension)
    held = [name for name in GENERATORS[0] if name not in names]
    assert not (dimension == 2 and held)
