"""A real pole whose place the records do not tell stays there, its weight free; others move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.infer import long_records
from bayes_hw.infer.inference import estimated, infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.unseen_poles import LEAST_SHARE, shares_of_records, without_unseen_poles
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Record

SIGMA = 0.01


def with_lag(model: HammersteinWiener, zero: float) -> HammersteinWiener:
    """The axis with a slow lag, and a zero that all but cancels it where it is near the pole at 0.97."""
    linear = model.linear
    poles, zeros = np.append(linear.poles, 0.97), np.append(linear.zeros, zero)
    gain = linear.gain * (1 - 0.97) / (1 - zero)
    return replace(model, linear=LinearBlock(zeros, poles, gain, linear.delay_samples), noise_sigma=SIGMA)


def records_of(model: HammersteinWiener) -> list[Record]:
    rng, rate = np.random.default_rng(1), model.sample_rate_hz
    found = []
    for name in ("a", "b"):
        u = np.repeat(rng.normal(0, 0.9, size=60), 10)
        y = model.simulate(u).y + SIGMA * rng.standard_normal(len(u))
        found.append(Record(name, np.arange(len(u)) / rate, u, y, rate, model.units))
    return found


def slow_pole(axis: AxisParameters) -> str:
    """The name of the real pole at 0.97."""
    return next(n for n, v in zip(axis.names, axis.nominal, strict=True) if abs(v - 0.97) < 1e-9)


@pytest.mark.parametrize(("zero", "held"), [(0.97002, True), (0.9, False)])
def test_the_records_decide_which_poles_move(small_axis: HammersteinWiener, zero: float, held: bool) -> None:
    model = with_lag(small_axis, zero)
    axis, records = AxisParameters(model, "all"), records_of(model)
    name = slow_pole(axis)
    chosen = without_unseen_poles(axis, records)
    assert chosen.held_poles == ((name.removesuffix(".value"),) if held else ())
    assert (name in chosen.names) is not held
    assert name.replace(".value", ".weight") in chosen.names
    share = dict(zip(axis.names, shares_of_records(axis, records), strict=True))
    assert bool(share[name] < LEAST_SHARE) is held
    assert share["saturation.upper"] > 0.9


def test_as_many_samples_again_tell_as_much_again(small_axis: HammersteinWiener) -> None:
    model = with_lag(small_axis, 0.9)
    axis, records = AxisParameters(model, "all"), records_of(model)
    threefold = shares_of_records(axis, records * 3)
    np.testing.assert_allclose(shares_of_records(axis, records, times=3.0), threefold, rtol=1e-6)


def test_poles_that_long_records_do_not_tell_stay(
    small_axis: HammersteinWiener, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two beside the Nyquist frequency have one place among those of free poles, and so no order there."""
    linear = small_axis.linear
    nyquist = [-0.9999995, -0.9999993]
    poles, zeros = np.append(linear.poles, nyquist), np.append(linear.zeros, [-0.99999, -0.99998])
    both = LinearBlock(zeros, poles, linear.gain, linear.delay_samples)
    model = replace(small_axis, linear=both, noise_sigma=SIGMA)
    records = records_of(model)
    monkeypatch.setattr(long_records, "LONG_SAMPLES", 1000)
    found = estimated(model, records, np.random.default_rng(1))
    assert len(found.axis.held_poles) == 2
    start = found.start
    assert np.isfinite(LogPosterior(found.axis, start.noise_parameters, records)(start.coordinates[None]))


def test_of_two_fast_poles_the_faster_stays(small_axis: HammersteinWiener) -> None:
    """Whatever the records tell of its place; alone it moves."""
    linear = small_axis.linear
    for added, held in (([0.1, 0.6], True), ([0.1, 0.9], False)):
        poles, zeros = np.append(linear.poles, added), np.append(linear.zeros, [-0.6])
        gain = linear.gain * float(np.prod(1 - np.array(added))) / 1.6
        both = LinearBlock(zeros, poles, gain, linear.delay_samples)
        model = replace(small_axis, linear=both, noise_sigma=SIGMA)
        quiet = [replace(record, y=model.simulate(record.u).y) for record in records_of(model)]
        rng = np.random.default_rng(2)
        quiet = [replace(r, y=r.y + 1e-5 * rng.standard_normal(len(r))) for r in quiet]
        axis = AxisParameters(model, "all")
        name = next(
            n
            for n, v in zip(axis.names, axis.nominal, strict=True)
            if n.startswith("real_pole") and abs(v - 0.1) < 1e-9
        )
        chosen = without_unseen_poles(axis, quiet)
        assert (name.removesuffix(".value") in chosen.held_poles) is held
        assert name.replace(".value", ".weight") in chosen.names


def test_an_axis_with_a_held_pole_is_the_same_axis(small_axis: HammersteinWiener) -> None:
    model = with_lag(small_axis, 0.95)
    free = AxisParameters(model, "all")
    held = AxisParameters(model, "all", held_poles=(slow_pole(free).removesuffix(".value"),))
    assert len(held.names) == len(free.names) - 1
    assert held.in_order(held.nominal[:, None])[0]
    np.testing.assert_allclose(held.put_in_order(held.nominal), held.nominal, atol=1e-12)
    u = np.repeat(np.random.default_rng(2).normal(0, 0.9, size=40), 10)
    np.testing.assert_allclose(held.to_model(held.nominal).simulate(u).y, model.simulate(u).y, atol=1e-9)


@pytest.mark.slow
def test_a_posterior_with_a_held_pole_converges_and_is_read_back(
    small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """With the pole free the same sampler needs hundreds of steps an independent draw."""
    model = with_lag(small_axis, 0.97002)
    folder = tmp_path_factory.mktemp("posterior")
    settings = SamplerSettings(max_steps=200)
    posterior = infer(model, records_of(model), np.random.default_rng(3), settings=settings).posterior
    assert posterior.axis.held_poles
    assert posterior.converged
    posterior.write(folder)
    again = Posterior.read(folder)
    assert again.names == posterior.names
    assert again.to_dict()["held_poles"] == list(posterior.axis.held_poles)
    assert again.summaries["saturation.upper"].mean == pytest.approx(
        posterior.summaries["saturation.upper"].mean, rel=1e-3
    )
