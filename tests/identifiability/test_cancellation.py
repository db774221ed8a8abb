"""Near cancellations are measured by what leaving them out changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import nanshan_model

from bayes_hw.identifiability.cancellation import largest_change, near_cancellations
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock


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
