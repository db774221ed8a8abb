"""Known inputs: derivatives, the way in which a column acts, columns that nothing follows, the verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, RATE, SIGMA, STRUCTURE, record, scale
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.joint.answer.corrected_model import simulate_corrected
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.posterior.reported_quantities import effect_quantities
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.search.known_input import (
    READING,
    TORQUE,
    forms_of,
    telling_lag,
    with_known_inputs,
)
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.known_input import delayed_column
from bayes_hw.record import Record

SAMPLES = 700
LAG = 4.3


def slow(samples: int, seed: int, corner: float = 0.15) -> FloatArray:
    """Noise of a corner (Hz), of deviation one."""
    b, a = signal.butter(2, corner, fs=RATE)
    found = signal.lfilter(b, a, np.random.default_rng(seed).standard_normal(samples))
    return np.asarray(found / found.std())


def blown() -> Effect:
    """The effect of a column "wind" as a torque."""
    ports = Ports(
        np.zeros(0), np.array([[0.0012], [-0.0007]]), np.array([0.0, 0.5]), np.zeros(0), np.zeros((2, 1))
    )
    return Effect(forms_of("wind")[0], np.array([LAG]), ports)


def records_with(effects: tuple[Effect, ...], seeds: tuple[int, ...]) -> list[Record]:
    """Records of the small axis with columns "wind", which acts as `effects` say, and "decoy"."""
    response = JointResponse(STRUCTURE, effects, (), scale(SAMPLES))
    found = []
    for seed in seeds:
        known = {"wind": 5 + 2 * slow(SAMPLES, seed), "decoy": slow(SAMPLES, seed + 50)}
        u = record(np.zeros(SAMPLES), seed).u
        y = response.simulate(JointValues(CASCADE, effects), u, known).y
        y = y + SIGMA * np.random.default_rng(seed + 100).standard_normal(SAMPLES)
        found.append(replace(record(y, seed), known=known, known_units={"wind": "m/s"}))
    return found


def base_of(records: list[Record]) -> JointFit:
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    start = response.coordinates(JointValues(CASCADE))
    return JointFit(response, evaluate(response, start)).descended()


@pytest.mark.parametrize("way", [0, 1])
@pytest.mark.parametrize("lag", [LAG, -2.6])
def test_derivatives_are_those_of_differences(way: int, lag: float) -> None:
    form = forms_of("wind")[way]
    effect = replace(blown(), values=np.array([lag])) if way == 0 else Effect(form, np.array([0.01, lag]))
    response = JointResponse(STRUCTURE, (effect,), records_with((), (1,)), scale(SAMPLES))
    x = response.coordinates(JointValues(CASCADE, (effect,)))
    ((rows, _, _),) = response.linearise(x, 0)
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = 1e-6
        ahead, behind = response.residuals(x + step)[0], response.residuals(x - step)[0]
        np.testing.assert_allclose(rows[i], (behind - ahead) / 2e-6, atol=2e-5 * np.abs(rows[i]).max() + 1e-7)


def test_a_delayed_column_counts_from_its_beginning() -> None:
    column = np.arange(40.0) ** 1.5 + 7
    level = column[:10].mean()
    shown, _ = delayed_column({"x": column}, "x", 2.25, 40)
    assert shown[20] == pytest.approx(0.75 * column[18] + 0.25 * column[17] - level)
    assert shown[0] == shown[1] == 0.0
    early, _ = delayed_column({"x": column}, "x", -3.0, 40)
    np.testing.assert_allclose(early[:37], column[3:] - level)
    with pytest.raises(InputError, match="--known x"):
        delayed_column({}, "x", 0.0, 40)


def test_a_wind_is_found_as_a_torque_and_a_decoy_is_not() -> None:
    """The lag with that of the structure to 0.03 s, the gain to 5 %, the noise back to its size."""
    records = records_with((blown(),), (1, 2))
    fit, columns = with_known_inputs(base_of(records))
    assert [(one.column, one.accepted) for one in columns] == [("wind", True), ("decoy", False)]
    assert columns[0].way == TORQUE and columns[0].nats > 100
    truth = JointValues(CASCADE, (blown(),))
    response = JointResponse(STRUCTURE, truth.effects, records, scale(SAMPLES))
    assert fit.point.rms == pytest.approx(SIGMA, rel=0.05)
    found, expected = (
        effect_quantities(one, one.values)
        for one in (fit, JointFit(response, evaluate(response, response.coordinates(truth))))
    )
    assert found["known:wind.lag"] == pytest.approx(expected["known:wind.lag"], abs=0.03)
    assert found["known:wind.gain"] == pytest.approx(expected["known:wind.gain"], rel=0.05)


@pytest.mark.slow
def test_a_reading_that_follows_a_temperature_is_found_at_the_encoder() -> None:
    warm = Effect(forms_of("wind")[1], np.array([0.004, 0.0]))
    fit, found = with_known_inputs(base_of(records_with((warm,), (3, 4))))
    assert [one.column for one in found if one.accepted] == ["wind"]
    assert found[0].way == READING
    assert fit.values.effects[0].values[0] == pytest.approx(0.004, rel=0.1)


@pytest.mark.slow
def test_nothing_follows_what_does_not_act() -> None:
    """Two columns, four records each: none accepted."""
    for seeds in ((5, 6), (7, 8)):
        _, found = with_known_inputs(base_of(records_with((), seeds)))
        assert not any(one.accepted for one in found)


@pytest.mark.slow
def test_diagnosis_says_that_the_gap_follows_the_column() -> None:
    """No effect of the catalogue is named, the block `known` holds probability, block, closure, gain and lag;
    corrected.json predicts with the column and is refused without it."""
    records = records_with((blown(),), (1, 2, 3))
    records = [replace(r, known={"wind": r.known["wind"]}) for r in records]
    found = diagnose_records(records[:2], records[2:], np.random.default_rng(1), start="rest")
    assert found.verdict.answer == ()
    wind = found.verdict.to_dict()["known"]["wind"]  # type: ignore[index]
    assert wind["follows"] and wind["probability"] > 0.9 and wind["block"] == "disturbance"
    assert wind["gap"]["holdout"]["closed"] > 0.8
    low, high = wind["lag_s"]["hdi94"]
    truth = JointValues(CASCADE, (blown(),))
    response = JointResponse(STRUCTURE, truth.effects, records, scale(SAMPLES))
    whole = JointFit(response, evaluate(response, response.coordinates(truth)))
    assert low - 0.03 < effect_quantities(whole, truth)["known:wind.lag"] < high + 0.03
    assert "follows wind" in found.sentence()
    run = simulate_corrected(found.corrected, records[2].u, records[2].known)
    np.testing.assert_allclose(run.y, found.after, atol=1e-12)
    model = HammersteinWiener.from_dict(found.corrected)
    plain = model.simulate(records[2].u, known=records[2].known)
    np.testing.assert_allclose(plain.y, found.after, atol=1e-6)
    assert model.known[0].lag_samples / RATE == pytest.approx(wind["lag_s"]["mean"], abs=0.05)
    with pytest.raises(InputError, match="known input 'wind'"):
        simulate_corrected(found.corrected, records[2].u)
    bare = replace(records[2], known={})
    with pytest.raises(InputError, match="wind"):
        diagnose_records(records[:2], [bare], np.random.default_rng(1))


@pytest.mark.parametrize("lag", [-3, 0, 17])
def test_the_lag_of_a_rough_column_is_seen_in_steps(lag: int) -> None:
    """White from sample to sample, at the encoder, beside a random walk."""
    records = records_with((), (1, 2))
    rough = [np.random.default_rng(k).standard_normal(SAMPLES + 40) for k in (7, 8)]
    walks = [np.cumsum(np.random.default_rng(k).standard_normal(SAMPLES)) for k in (9, 10)]
    blown_at = [
        replace(one, known={"rough": x[20:-20]}, y=one.y + SIGMA * (x[20 - lag : SAMPLES + 20 - lag] + walk))
        for one, x, walk in zip(records, rough, walks, strict=True)
    ]
    assert telling_lag(base_of(blown_at), "rough") == lag
