"""Shapes of an axis that remembers: zero until the event, then of its sign, and gone after a while."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.free_functions import Motion
from bayes_hw.gap.criticism.memories import AGES_S, shapes_of_memories

RATE = 20.0


def motion(command: FloatArray, limit: float = 1.0) -> Motion:
    limited = np.clip(command, -limit, limit)
    return Motion(command, limited, np.cumsum(limited) / RATE, limited)


def test_after_a_limit_the_shapes_have_its_side_and_end() -> None:
    command = np.full(200, 0.5)
    command[20:30], command[100:110] = 2.0, -2.0
    _, (shapes,) = shapes_of_memories([motion(command)], RATE)["after a limit"]
    splines = shapes[:, : len(AGES_S) - 1].sum(axis=1)
    assert not splines[:30].any() and not splines[100:110].any()
    assert splines[30] == 1 and splines[110] == -1
    assert not splines[30 + int(AGES_S[-1] * RATE) : 100].any()


def test_changes_of_the_command_count_soon_after_a_limit_only() -> None:
    rng = np.random.default_rng(2)
    command = rng.uniform(-0.9, 0.9, 300)
    command[50:60] = 3.0
    _, (shapes,) = shapes_of_memories([motion(command)], RATE)["after a limit"]
    changes = shapes[:, len(AGES_S) - 1 :]
    assert not changes[:60].any() and changes[60:65].all() and not changes[100:].any()


def test_a_limit_that_is_never_reached_has_no_shapes_but_zeros() -> None:
    _, (shapes,) = shapes_of_memories([motion(np.sin(np.arange(100.0)) * 0.5)], RATE)["after a limit"]
    assert not shapes.any()


def test_after_a_reversal_the_shapes_have_the_new_direction() -> None:
    speed = np.concatenate([np.full(40, 1.0), np.zeros(10), np.full(50, -1.0), np.full(60, 1.0)])
    _, (shapes,) = shapes_of_memories([motion(speed, 2.0)], RATE)["after a reversal"]
    total = shapes.sum(axis=1)
    assert not total[:50].any()
    assert total[50] == -1 and total[99] < 0 and total[100] == 1 and not total[155:].any()
