"""What of the dead zone's uncertainty is that of slow poles: against a covariance put there on purpose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from spread_axis import spread_posterior

from bayes_hw.infer.dead_zone_trade import FAST, PAIRS, SLOW, STATIC, trade_of
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Record, Units

MODEL = nanshan_model(0.006, 0.002)
TIME = np.arange(2400) / 20.0
RECORD = Record("r", TIME, 0.2 * np.sin(2.2 * TIME), np.zeros(2400), 20.0, Units())


def _draws(correlation: float) -> tuple[AxisParameters, np.ndarray]:
    """Small scatter about the twin, the half width tied to the weight of the slowest pole."""
    axis = AxisParameters(MODEL, "all")
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((4000, len(axis.parameters)))
    poles = [name for name in axis.names if name.endswith(".value")]
    slowest = max(poles, key=lambda name: axis.nominal[axis.names.index(name)])
    weight = axis.names.index(slowest.replace(".value", ".weight"))
    row = axis.names.index("dead_zone.half_width")
    noise[:, row] = correlation * noise[:, weight] + np.sqrt(1 - correlation**2) * noise[:, row]
    values = axis.nominal * (1 + 0.001 * noise)
    return axis, values


def test_the_share_of_slow_poles_is_the_square_of_their_correlation() -> None:
    for correlation in (0.0, 0.8):
        axis, values = _draws(correlation)
        found = trade_of(axis, values, [RECORD])
        assert found is not None and set(found.sd_known) <= {SLOW, FAST, PAIRS, STATIC}
        assert found.sd == pytest.approx(0.006e-3, rel=0.05)
        assert found.share(SLOW) == pytest.approx(correlation**2, abs=0.03)
        assert found.share(STATIC) < 0.03
        assert found.to_dict()["share_of_variance"][SLOW] == found.share(SLOW)
    assert "trade places" in found.sentence and f"({100 * found.share(SLOW):.0f} %" in found.sentence


def test_the_lag_is_what_the_slow_poles_take_of_a_held_command() -> None:
    """A response to a constant command, less that of the integrator and of all that settles fast."""
    axis, values = _draws(0.0)
    found = trade_of(axis, values, [RECORD])
    assert found is not None and found.lag is not None
    batch = axis.linear_batch(axis.nominal[:, None])
    poles, residues = batch.real_poles[:, 0], batch.residues()[0][:, 0]
    slow = (poles > np.exp(-1 / 10)) & (poles < 1 - 1e-9)
    usual = np.sqrt(np.mean(np.clip(RECORD.u, MODEL.saturation.lower, MODEL.saturation.upper) ** 2))
    expected = -usual * np.sum(residues[slow] / (1 - poles[slow]))
    assert found.lag[0] == pytest.approx(expected, rel=0.05)


def test_held_roots_say_nothing_and_a_fast_axis_says_so() -> None:
    assert trade_of(AxisParameters(MODEL, "conditional"), spread_posterior(MODEL).values, [RECORD]) is None
    fast = replace(MODEL, linear=LinearBlock(np.zeros(0), np.array([1.0, 0.3]), 0.03, 2), dominant_modes=())
    found = trade_of(AxisParameters(fast, "all"), spread_posterior(fast, "all", 0.001).values, [RECORD])
    assert found is not None and found.lag is None and "no slow pole" in found.sentence


def test_the_weight_of_a_pole_that_is_held_counts_with_it() -> None:
    """Its value is no parameter then; which group its weight is in follows from where it stands."""
    axis, values = _draws(0.8)
    slowest = [name for name in axis.names if name.endswith(".value")][-1].partition(".")[0]
    held = AxisParameters(MODEL, "all", held_poles=(slowest,))
    kept = [axis.names.index(name) for name in held.names]
    found = trade_of(held, values[:, kept], [RECORD])
    assert found is not None and found.share(SLOW) == pytest.approx(0.64, abs=0.05)
