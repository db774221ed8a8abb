"""Resampling: the command keeps its area, the output its values, and the record says what was done."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.log.resample import describe, resample_columns
from bayes_hw.record import Record, Units


def held_area(t, u, stop_s):
    """Integral of the held command from the first stamp for `stop_s` seconds, by summing rectangles."""
    ends = np.append(t[1:], t[0] + stop_s)
    return float(np.sum(u * (np.minimum(ends, t[0] + stop_s) - np.minimum(t, t[0] + stop_s))))


uneven_columns = st.lists(
    st.tuples(st.floats(0.01, 1), st.floats(-10, 10), st.floats(-10, 10)), min_size=3, max_size=60
).map(lambda rows: tuple(np.array(column) for column in zip(*rows, strict=True)))


@settings(deadline=None)
@given(uneven_columns, st.floats(1.0, 40.0), st.sampled_from([0.0, 5.3]))
def test_the_area_under_the_held_command_is_kept(columns, rate_hz, start):
    steps, u, y = columns
    t = start + np.cumsum(steps)
    if (t[-1] - t[0]) * rate_hz < 1:
        return
    t_new, u_new, y_new = resample_columns(t, u, y, rate_hz)
    assert len(t_new) == len(u_new) == len(y_new)
    stop_s = len(t_new) / rate_hz
    area = held_area(t, u, stop_s)
    assert np.sum(u_new) / rate_hz == pytest.approx(area, rel=1e-9, abs=1e-9 * stop_s)


@settings(deadline=None)
@given(uneven_columns, st.floats(1.0, 40.0))
def test_an_integrator_driven_by_the_held_command_keeps_its_output_at_every_new_sample(columns, rate_hz):
    steps, u, _ = columns
    t = np.cumsum(steps)
    if (t[-1] - t[0]) * rate_hz < 1:
        return
    position = np.concatenate([[0.0], np.cumsum(u[:-1] * np.diff(t))])
    t_new, u_new, y_new = resample_columns(t, u, position, rate_hz)
    rebuilt = np.concatenate([[0.0], np.cumsum(u_new[:-1]) / rate_hz])
    np.testing.assert_allclose(y_new, rebuilt, atol=1e-8)
    np.testing.assert_allclose(np.diff(t_new), 1 / rate_hz)


def test_decimating_by_a_whole_factor_keeps_every_nth_output_and_averages_the_command():
    generator = np.random.default_rng(1)
    u, y = generator.normal(size=(2, 100))
    t_new, u_new, y_new = resample_columns(np.arange(100) / 100, u, y, 20.0)
    np.testing.assert_allclose(t_new, np.arange(20) / 20)
    np.testing.assert_allclose(y_new, y[::5], atol=1e-12)
    np.testing.assert_allclose(u_new, u.reshape(20, 5).mean(axis=1), atol=1e-12)


def test_the_same_rate_changes_nothing():
    generator = np.random.default_rng(2)
    u, y = generator.normal(size=(2, 200))
    t = np.arange(200) / 50
    for new, old in zip(resample_columns(t, u, y, 50.0), (t, u, y), strict=True):
        np.testing.assert_allclose(new, old, atol=1e-12)


def test_stamps_counted_from_the_epoch_are_kept():
    t = 1_685_543_398.58531 + np.arange(100) / 20
    t_new, _, _ = resample_columns(t, np.arange(100.0), np.arange(100.0), 10.0)
    assert t_new[0] == t[0]
    np.testing.assert_allclose(np.diff(t_new), 0.1, atol=5e-7)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), float("inf"), 1e12, 1e-9])
def test_a_rate_that_gives_no_record_is_refused_in_one_line(rate_hz):
    columns = np.arange(40.0)
    with pytest.raises(InputError) as caught:
        resample_columns(columns / 20, columns, columns, rate_hz)
    assert "--resample" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_resampled_record_says_from_what_to_what_and_keeps_its_provenance():
    t = np.arange(200) / 100
    record = Record("axis", t, np.sin(t), np.cos(t), 100.0, Units(), "axis.csv", "digest", ("cut",))
    resampled = record.resampled(20.0)
    assert resampled.sample_rate_hz == 20.0
    assert len(resampled) == 40
    assert (resampled.source, resampled.sha256) == ("axis.csv", "digest")
    assert resampled.treatment[0] == "cut"
    assert "from 100 Hz to 20 Hz" in resampled.treatment[1]
    assert "without an anti-alias filter" in resampled.treatment[1]


def test_gaps_are_counted_and_placed():
    t = np.arange(100) / 20
    t[40:] += 1.0
    t[70:] += 0.5
    sentence = describe(t, 20.0, lambda index: f"row {index + 2}")
    assert "longest 1.05 s ending at row 42" in sentence
    assert "gaps longer than 3 median steps: 2, 1.6 s in all, the first ending at row 42" in sentence
    assert "anti-alias" not in sentence
