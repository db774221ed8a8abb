"""Where the gap lies: block, band, regime, time, coherence of residuals made to lie there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from drive_axis import RATE, SIGMA, command, white
from fitted import AXIS, SAMPLES, base, explained, with_residuals

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.judgement import Remains
from bayes_hw.gap.answer.locate import (
    THIRDS,
    Location,
    block_shares,
    command_coherences,
    excess_band,
    locate,
    regime_masks,
    regime_ratios,
)
from bayes_hw.gap.criticism.block_functions import block_negative_log_p, shapes_of_memories, with_floor
from bayes_hw.gap.criticism.free_functions import motions
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic, is_in_the_scatter
from bayes_hw.gap.effects.catalogue import CommandBias, KinematicBacklash
from bayes_hw.gap.effects.labels import BLOCKS, LABEL_BLOCKS
from bayes_hw.gap.search.attribute import Attribution

EVEN = dict.fromkeys(BLOCKS, 0.2)
INPUTS = [command(SAMPLES, seed) for seed in range(2)]
T = np.arange(SAMPLES) / RATE


def noise() -> list[FloatArray]:
    return [white(SAMPLES, SIGMA, record) for record in range(2)]


def attribution(residuals: list[FloatArray]) -> Attribution:
    """A base with `residuals` and no other explanation."""
    found = explained(residuals)
    return Attribution(base=found, explanations=(found,), base_costs=(1.0,), singles=())


def decision(answer: tuple[str, ...], blocks: Mapping[str, float] = EVEN, **probability: float) -> Decision:
    """A decision with these probabilities, none and other at zero unless given."""
    unused: Any = None
    return Decision(answer, unused, {"none": 0.0, "other": 0.0, **probability}, (), {}, blocks)


def located(
    residuals: list[FloatArray], answer: tuple[str, ...], left: Sequence[ResidualDiagnostic] = ()
) -> Location:
    """What is said of `residuals` where these are the leftovers."""
    found = attribution(residuals)
    negative_log_p = with_floor(block_negative_log_p(found.base.fit, INPUTS), is_in_the_scatter(left))
    blocks = Remains((), blocks=negative_log_p).probability_of_blocks(Calibration.built_in().block_sharpness)
    return locate(found, decision(answer, blocks, other=0.9), INPUTS, SIGMA)


def test_shares_are_those_of_labels_and_of_what_has_no_name() -> None:
    """Worked by hand; two causes count half each; what is missing to one is no gap."""
    unnamed = {**dict.fromkeys(BLOCKS, 0.1), "linear": 0.6}
    one = decision(("friction",), unnamed, none=0.1, other=0.3, friction=0.6)
    assert block_shares(one, LABEL_BLOCKS) == pytest.approx(
        {"input": 0.03, "linear": 0.18, "drive": 0.63, "disturbance": 0.03, "sensor": 0.03}
    )
    two = decision(("outliers", "wind"), unnamed, wind=0.9, outliers=0.9)
    assert block_shares(two, LABEL_BLOCKS) == pytest.approx(
        {**dict.fromkeys(BLOCKS, 0.0), "disturbance": 0.5, "sensor": 0.5}
    )
    nothing = block_shares(decision((), unnamed, none=0.97, other=0.03), {})
    assert sum(nothing.values()) == pytest.approx(0.03)


def test_shares_of_a_cause_that_is_in_no_catalogue_are_given_that() -> None:
    """Whatever is left for labels of the catalogue."""
    unnamed = {**dict.fromkeys(BLOCKS, 0.1), "linear": 0.6}
    assert block_shares(decision(("other",), unnamed, other=0.8, wind=0.2), LABEL_BLOCKS) == unnamed


def test_a_label_of_another_package_has_its_own_block() -> None:
    blocks: dict[str, Any] = {"ice": "dish"}
    assert block_shares(decision(("ice",), ice=0.9, snow=0.1), blocks)["dish"] == 0.9


@pytest.mark.compiles("chains")
def test_a_torque_that_remembers_reversals_is_the_drive() -> None:
    """A torque largest 0.4 s after the axis turned: without memory it would be taken for lags."""
    fit = with_residuals(noise())
    chain = fit.hypothesis.chain(fit.values)
    moved = motions(fit, INPUTS)
    door, shapes = shapes_of_memories(moved, RATE)["after a reversal"]
    responses = [chain.small_responses(door, own)[:, 2] for own in shapes]
    size = 2 * SIGMA / np.sqrt(np.mean(np.concatenate(responses) ** 2))
    residuals = [e + size * r for e, r in zip(noise(), responses, strict=True)]
    found = located(residuals, ("other",))
    assert found.block == "drive" == max(found.share, key=lambda block: found.share[block])


@pytest.mark.parametrize(
    ("answer", "block"),
    [(("command_bias",), "input"), ((), "none"), (("other",), "sensor"), (("friction", "backlash"), "drive")],
)
def test_the_block_is_that_of_the_answer(answer: tuple[str, ...], block: str) -> None:
    """Of what has no name and no function takes anything of, the sensor."""
    assert located(noise(), answer).block == block


def test_the_block_of_two_is_that_which_takes_more() -> None:
    simulated = with_residuals(noise()).simulated
    shapes = [e + 2 * SIGMA * np.cos(6 * y / np.ptp(y)) for e, y in zip(noise(), simulated, strict=True)]
    for answer in (("friction", "gain_asymmetry"), ("gain_asymmetry", "wind")):
        assert located(shapes, answer).block == "sensor"


def test_scatter_that_follows_the_motion_is_the_sensor() -> None:
    """Where nothing is named, what is left is in single samples, and no function takes much more."""
    simulated = with_residuals(noise()).simulated
    torque = [e + 0.1 * SIGMA * np.sign(np.gradient(y)) for e, y in zip(noise(), simulated, strict=True)]
    left = [ResidualDiagnostic("spread", 90.0, 0.5), ResidualDiagnostic("function at drive", 30.0, 0.1)]
    assert not is_in_the_scatter(
        [ResidualDiagnostic("spread", 3.0, 0.5), ResidualDiagnostic("function at drive", 2.0, 0.1)]
    )
    plain, scattered = (located(torque, ("other",), given) for given in ((), left))
    assert scattered.block == "sensor" and scattered.share["sensor"] > plain.share["sensor"] + 0.01


@pytest.mark.parametrize("frequency", [0.3, 1.7, 5.0])
def test_the_band_holds_the_frequency(frequency: float) -> None:
    residuals = [e + 3 * SIGMA * np.sin(2 * np.pi * frequency * T) for e in noise()]
    low, high = excess_band(with_residuals(residuals), RATE)
    assert low <= 1.1 * frequency and high >= 0.9 * frequency
    assert high < 2 * low


def test_regimes_are_where_the_motion_says() -> None:
    """Saturated samples by the delayed command; an error put there alone is found there."""
    fit = with_residuals(noise())
    masks = regime_masks(fit, INPUTS)
    for u, saturated, y, slow in zip(INPUTS, masks["saturated"], fit.simulated, masks["slow"], strict=True):
        late = np.concatenate([np.zeros(AXIS.linear.delay_samples), u])[:SAMPLES]
        expected = (late < AXIS.saturation.lower) | (late > AXIS.saturation.upper)
        np.testing.assert_array_equal(saturated, expected)
        assert 0 < saturated.sum() < SAMPLES
        assert np.abs(np.gradient(y))[slow].max() < np.abs(np.gradient(y))[~slow].max()
    travelled = np.concatenate(fit.simulated)
    third = np.ptp(travelled) / 3
    lower, middle, upper = (np.concatenate(masks[name]) for name in THIRDS)
    assert (lower.astype(int) + middle + upper == 1).all()
    assert travelled[lower].max() < travelled.min() + third <= travelled[middle].min()
    assert travelled[middle].max() < travelled.max() - third <= travelled[upper].min()
    for name in ("saturated", "slow", "reversing", *THIRDS):
        residuals = [e + 5 * SIGMA * mask for e, mask in zip(noise(), masks[name], strict=True)]
        ratios = regime_ratios(with_residuals(residuals), INPUTS, SIGMA)
        assert max(ratios, key=lambda regime: ratios[regime]) == name
        assert ratios[name] == pytest.approx(26, rel=0.1)
    at_rest = np.concatenate(masks["dead zone"])
    near = np.abs(travelled) < AXIS.dead_zone.half_width / 2
    assert at_rest.any()
    np.testing.assert_array_equal(at_rest, near)
    quiet = regime_ratios(fit, INPUTS, SIGMA)
    assert all(value == pytest.approx(1, abs=0.35) for value in quiet.values())


@pytest.mark.parametrize("name", ["u", "|u|", "sign of speed"])
def test_coherence_with_what_makes_the_error(name: str) -> None:
    simulated = with_residuals(noise()).simulated
    shapes = {
        "u": INPUTS,
        "|u|": [np.abs(u) for u in INPUTS],
        "sign of speed": [0.1 * np.sign(np.gradient(y)) for y in simulated],
    }[name]
    residuals = [e + 0.2 * s for e, s in zip(noise(), shapes, strict=True)]
    found = command_coherences(with_residuals(residuals), INPUTS, RATE)
    assert set(found) == {"u", "u^2", "|u|", "sign of speed"}
    assert max(found, key=lambda key: found[key]) == name
    assert found[name] > 0.5


def test_segments_follow_the_time() -> None:
    """An error in the last third stands in the last third of the segments."""
    residuals = [e + 4 * SIGMA * (2 * T / T[-1] > 4 / 3) for e in noise()]
    found = locate(attribution(residuals), decision(("wind",)), INPUTS, SIGMA)
    assert np.array(found.segments[:8]) == pytest.approx(1, abs=0.25)
    assert min(found.segments[8:]) > 3
    assert [point.record for point in found.change_points] == [0, 1]
    assert all(p.time_s == pytest.approx(2 / 3 * T[-1], rel=0.05) for p in found.change_points)
    content = found.to_dict()
    assert {"block", "band_hz", "regime", "share"} <= set(content)
    assert base().with_effect(CommandBias()).with_effect(KinematicBacklash()).labels == (
        "command_bias",
        "backlash",
    )
