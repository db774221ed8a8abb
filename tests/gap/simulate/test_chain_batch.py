"""Lanes agree with one chain at a time, whatever stands in the other lanes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import command, drive_axis, hypothesis
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.catalogue import KinematicBacklash, TransportDelay, catalogue
from bayes_hw.gap.effects.drive import LoadRipple, MeshRipple, TorqueRipple
from bayes_hw.gap.effects.effect import Effect, PeriodicEffect
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.builder import KnownPositions
from bayes_hw.gap.simulate.chain_batch import delay, in_lanes, lanes_of, silence, simulate_chains, substeps_of
from bayes_hw.gap.simulate.chain_builder import ChainBuilder

EVERY = catalogue()
RIPPLES = [TorqueRipple(), LoadRipple(), MeshRipple()]
UNEVEN = (130, 90)
"""Samples of two records: lanes of one record go on while those of the other have ended."""


def points(found: Hypothesis, effect: Effect, seed: int) -> FloatArray:
    """Test values and starts of an effect, each beside base parameters drawn about the nominal ones."""
    rng = np.random.default_rng(seed)
    values = np.array([effect.test_values, *list(effect.starts(found.scale))[:9]])
    base = found.prior_means[: found.base_count] + 0.5 * found.prior_sds[: found.base_count] * rng.normal(
        size=(len(values), found.base_count)
    )
    plain = hypothesis(found.builder.model, found.inputs)
    return np.concatenate([plain.to_values(base), values], axis=1)


@pytest.mark.parametrize("rate", [20.0, 50.0, 125.0])
@pytest.mark.parametrize("effect", EVERY, ids=lambda effect: effect.name)
def test_lanes_agree_with_one_at_a_time(effect: Effect, rate: float) -> None:
    """Every effect, five, two and one step a sample, two records of different lengths."""
    inputs = [command(samples, 7, rate) for samples in UNEVEN]
    found = hypothesis(drive_axis(rate=rate), inputs, effect)
    values = points(found, effect, seed=int(rate))
    together = found.simulate_batch(values)
    for column, point in enumerate(values):
        for record, y in enumerate(found.simulate(point)):
            assert y.shape == (UNEVEN[record],)
            np.testing.assert_array_equal(together[record][:, column], y)


def test_neutral_lanes_stand_beside_active_ones() -> None:
    """An effect of no size in one lane, of some in the next; the order is kept."""
    inputs = [command(120, 3)]
    found = hypothesis(drive_axis(), inputs, TransportDelay(), KinematicBacklash())
    sizes = [(0.0, 0.0), (1.3, 0.01), (0.0, 0.01), (2.0, 0.0), (0.0, 0.0), (0.4, 0.02)]
    values = np.array([[*found.builder.axis.nominal, *size] for size in sizes])
    (together,) = found.simulate_batch(values)
    for column, point in enumerate(values):
        np.testing.assert_array_equal(together[:, column], found.simulate(point)[0])
    assert len(np.unique(together[-1])) == 5


def test_a_lane_that_runs_away_leaves_the_others_alone() -> None:
    found = hypothesis(drive_axis(), [command(120, 3)])
    values = np.repeat(found.builder.axis.nominal[None], 3, axis=0)
    values[1, 3] = np.inf
    with np.errstate(all="ignore"):
        (together,) = found.simulate_batch(values)
    assert not np.isfinite(together[:, 1]).all()
    np.testing.assert_array_equal(together[:, 0], together[:, 2])
    np.testing.assert_array_equal(together[:, 0], found.simulate(values[0])[0])


@pytest.mark.parametrize("effect", RIPPLES, ids=lambda effect: effect.name)
def test_ripple_at_known_positions_is_a_given_torque(effect: PeriodicEffect) -> None:
    """On an axis at rest, which a weak ripple hardly moves, its torque is that of the positions told."""
    found = hypothesis(drive_axis(), [np.zeros(samples) for samples in UNEVEN], effect)
    nominal, sine, cosine, period = found.builder.axis.nominal, 1e-6, 5e-7, 0.3
    positions = [0.2 * np.sin(0.1 * np.arange(samples)) for samples in UNEVEN]
    values = np.array([*nominal, sine, cosine, period])
    for share in (1.0, 0.4):
        led, _ = replace(found, known=KnownPositions(positions, share)).motion(values)
        for w, position in zip(led, positions, strict=True):
            angle = 2 * np.pi * share * position / period
            torque = sine * np.sin(angle) + cosine * (np.cos(angle) - 1)
            expected = found.chain(values).small_responses(effect.door, torque[:, None])[:, 0]
            np.testing.assert_allclose(w, expected, atol=1e-4 * np.ptp(expected))


@pytest.mark.parametrize("effect", RIPPLES, ids=lambda effect: effect.name)
def test_ripple_at_the_simulated_positions_is_itself(effect: Effect) -> None:
    inputs = [command(samples, 7) for samples in UNEVEN]
    found = hypothesis(drive_axis(), inputs, effect)
    values = np.array([*found.builder.axis.nominal, *effect.test_values])
    own, _ = found.motion(values)
    elsewhere = [w + 0.1 for w in own]
    for known in (KnownPositions(own, 1.0), KnownPositions(elsewhere, 0.0)):
        for w, unled in zip(replace(found, known=known).motion(values)[0], own, strict=True):
            np.testing.assert_allclose(w, unled, atol=1e-12)
    moved, _ = replace(found, known=KnownPositions(elsewhere, 1.0)).motion(values)
    assert np.ptp(moved[0] - own[0]) > 1e-4


def test_w_is_kept_on_request() -> None:
    builder = ChainBuilder(drive_axis())
    chain, settings = builder.chain(builder.axis.nominal), S.NEUTRAL[None]
    (kept,) = simulate_chains([chain], settings, [command(50, 1)], keep_w=True)
    (without,) = simulate_chains([chain], settings, [command(50, 1)])
    np.testing.assert_array_equal(kept.w, kept.y)
    np.testing.assert_array_equal(without.y, kept.y)
    assert without.w.shape == (0, 1)


@pytest.mark.parametrize(
    ("rate", "torques", "ramp", "both"),
    [(10.0, 20, 8, 20), (20.0, 10, 8, 10), (50.0, 4, 4, 4), (125.0, 2, 4, 4)],
)
def test_steps_a_sample(rate: float, torques: int, ramp: int, both: int) -> None:
    """5 ms for torques, 6.25 ms and four to eight where the command changes within a sample, else one."""
    none, forces, changes = np.zeros((3, S.COUNT), dtype=np.bool_)
    forces[S.GAP], changes[S.COMMAND_RATE] = True, True
    found = [substeps_of(active, rate) for active in (none, forces, changes, forces | changes)]
    assert found == [1, torques, ramp, both]


@settings(deadline=None)
@given(st.integers(1, 9), st.integers(1, 4), st.integers(0, 15))
def test_lanes_hold_every_chain_of_every_record_and_the_last_one_again(
    count: int, records: int, more: int
) -> None:
    lanes = lanes_of(count, records, count * records + more)
    np.testing.assert_array_equal(lanes[: count * records], list(range(count)) * records)
    np.testing.assert_array_equal(lanes[count * records :], count - 1)


def test_settings_go_to_their_lanes() -> None:
    rows, lanes = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([1, 0, 1])
    np.testing.assert_array_equal(in_lanes(rows, lanes), [[2, 1, 2], [4, 3, 4]])


@settings(deadline=None)
@given(st.lists(st.integers(0, 12), min_size=1, max_size=4), st.integers(0, 3))
def test_commands_are_late_by_whole_samples(delays: list[int], longer: int) -> None:
    """Nothing before they arrive, nor where another record of the batch is longer."""
    u = np.arange(1.0, 9.0)
    columns = silence(len(u) + longer, len(delays) + 2)
    delay(columns, 1, u, np.array(delays))
    assert not columns[:, 0].any() and not columns[:, -1].any()
    for i, late in enumerate(delays):
        expected = np.zeros(len(u) + longer)
        expected[late : len(u)] = u[: max(len(u) - late, 0)]
        np.testing.assert_array_equal(columns[:, 1 + i], expected)
