"""The flat directions found numerically are those of the scaling group, at every point and every subset."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import nanshan_model

from bayes_hw.identifiability import structure
from bayes_hw.identifiability.freed_gains import ALL_FREED, ASYMMETRIES, SLOPE
from bayes_hw.identifiability.structure import (
    SMALLEST_GAP,
    analyse_structure,
    largest_change,
    near_cancellations,
    rich_command,
)
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock


@pytest.mark.parametrize("which", ["small", "nanshan"])
def test_flat_directions_are_the_group(small_axis: HammersteinWiener, which: str) -> None:
    """Two at each of 40 points, behind a gap of far more than the criterion, within 1e-5 rad of the group."""
    model = small_axis if which == "small" else nanshan_model(0.006)
    found = analyse_structure(model, np.random.default_rng(1), points=40)
    assert found.agrees
    assert set(found.flat) == {2}
    assert found.gap.min() > 10 * SMALLEST_GAP
    assert found.angle.max() < 1e-5
    assert found.orbit_error.max() < 1e-11
    share = dict(zip(found.names, found.flat_share, strict=True))
    assert share["mode1.frequency_hz"] < 1e-6
    assert min(share[name] for name in (*ALL_FREED, "gain", "saturation.lower")) > 0.4


@pytest.mark.parametrize(("freed", "expected"), [(ASYMMETRIES, 0), ((SLOPE, *ASYMMETRIES), 1)])
def test_held_gains_leave_fewer(small_axis: HammersteinWiener, freed: tuple[str, ...], expected: int) -> None:
    found = analyse_structure(small_axis, np.random.default_rng(2), freed=freed, points=10)
    assert found.agrees
    assert set(found.flat) == {expected}


def test_settings_are_told_apart(small_axis: HammersteinWiener) -> None:
    found = analyse_structure(small_axis, np.random.default_rng(3), points=5)
    kinds = {setting.name: setting.normalization for setting in found.settings}
    assert kinds == {"c1 = 1": True, "c2 = 1": True, "c3 = c2": False, "delta- = delta+": False}


def test_a_wrong_group_is_found_out(small_axis: HammersteinWiener, monkeypatch: pytest.MonkeyPatch) -> None:
    """The angle sees a generator that forgets one parameter."""
    right = structure.acting_generators

    def wrong(names: tuple[str, ...]) -> np.ndarray:
        directions = right(names).copy()
        directions[names.index("dead_zone.gain_negative")] = 0.0
        return directions

    monkeypatch.setattr(structure, "acting_generators", wrong)
    found = analyse_structure(small_axis, np.random.default_rng(4), points=5)
    assert found.angle.min() > 0.1
    assert found.orbit_error.max() > 1e-3


def test_command_passes_both_limits(small_axis: HammersteinWiener) -> None:
    scaled = replace(small_axis, saturation=replace(small_axis.saturation, gain=2.0))
    u = rich_command(scaled, np.random.default_rng(5))
    assert np.mean(2 * u > 1.0) > 0.05
    assert np.mean(2 * u < -0.8) > 0.05


def with_roots(model: HammersteinWiener, zeros: list[complex], poles: list[complex]) -> HammersteinWiener:
    linear = model.linear
    return replace(
        model,
        linear=LinearBlock(
            np.concatenate([linear.zeros, zeros]), np.concatenate([linear.poles, poles]), linear.gain, 1
        ),
    )


def test_change_of_one_real_pair_is_closed_form() -> None:
    """|p - z| / (1 - |p|), reached at the pole's angle."""
    found = largest_change(np.array([0.9 + 0j]), np.array([0.905 + 0j]))
    assert found == pytest.approx(0.05, rel=1e-6)
    assert largest_change(np.array([1.0 + 0j]), np.array([0.9999 + 0j])) == np.inf


def test_close_pairs_are_named_and_others_are_not(small_axis: HammersteinWiener) -> None:
    assert near_cancellations(small_axis) == ()
    pole, zero = 0.5 + 0.6j, 0.505 + 0.598j
    roots = ([zero, zero.conjugate(), 0.7], [pole, pole.conjugate(), 0.71])
    found = near_cancellations(with_roots(small_axis, *roots))
    assert {each.poles for each in found} == {(0.71,), (pole, pole.conjugate())}
    pair = next(each for each in found if len(each.poles) == 2)
    assert pair.frequency_hz == pytest.approx(np.angle(pole) / (2 * np.pi) * 20)
    assert 0 < pair.change < 0.06


def test_two_real_poles_against_a_pair_of_zeros() -> None:
    """The printed 26 m model has one such group near z = 1."""
    (found,) = near_cancellations(nanshan_model(0.006))
    assert len(found.poles) == len(found.zeros) == 2
    assert all(abs(root - 1) < 0.02 for root in (*found.poles, *found.zeros))
