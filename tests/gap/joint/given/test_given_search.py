"""A given model in the joint search: its G and derivatives are exact, what is planted around it is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import (
    CASCADE,
    GIVEN_SAMPLES,
    RATE,
    SIGMA,
    command,
    form,
    measured,
    model,
    record,
    torque,
)
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.any_train import diagnose_around, needs_ports
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.joint.answer.corrected_model import simulate_corrected
from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.given import given_moves, given_search
from bayes_hw.gap.joint.given.given_base import best_base, reweighted
from bayes_hw.gap.joint.given.given_model import LIGHTEST, GivenModel
from bayes_hw.gap.joint.given.given_moves import further_modes, with_further_forms
from bayes_hw.gap.joint.given.given_response import GivenFit, GivenResponse
from bayes_hw.gap.joint.given.given_search import search_given
from bayes_hw.gap.joint.given.given_trail import Trail
from bayes_hw.gap.joint.given.given_verification import verified
from bayes_hw.gap.joint.noise.slow_noise import WIND, SlowNoise
from bayes_hw.gap.joint.residuals import readings
from bayes_hw.gap.joint.residuals.readings import Readings, read_again, read_faults
from bayes_hw.gap.joint.residuals.remainder import leaves_a_cause
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.gap.joint.search import laws_of_states
from bayes_hw.gap.joint.search.effect_moves import effect_candidates
from bayes_hw.gap.joint.search.laws_of_states import every_law
from bayes_hw.gap.joint.search.structural import explained_slowly
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.model.linear import LinearBlock

FEW = 400

LOOSE = tuple(0.01 for _ in GivenModel.of(model(), 1e-6).loose_sd)
RUB = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)


@pytest.fixture(scope="module")
def of_one() -> GivenFit:
    """The base under one record without effects."""
    return best_base(measured((), GIVEN_SAMPLES, (1,)), model())


@pytest.fixture(scope="module")
def of_two() -> GivenFit:
    """The same under two."""
    return best_base(measured((), GIVEN_SAMPLES, (1, 2)), model())


@pytest.fixture(scope="module")
def of_few() -> GivenFit:
    """The same under two short ones."""
    return best_base(measured((), FEW, (1, 2)), model())


@pytest.fixture(scope="module")
def rubbed() -> GivenFit:
    """The base under a short record with friction."""
    return best_base(measured((RUB,), FEW, (1,)), model())


ADDED = ((), (0.4,), (0.4, np.log(2.0), np.log(0.02), np.log(2.2), np.log(0.03), *LOOSE))


@pytest.mark.parametrize("added", ADDED, ids=["base", "delay", "delay and mode"])
def test_derivatives_are_those_of_the_response(added: tuple[float, ...], of_one: GivenFit) -> None:
    given = GivenModel.of(model(), 1e-6)
    part, further = len(added) > 0, len(added) > 1
    theta = np.concatenate([np.full(given.size, 0.01), added])
    records = [record(np.zeros(GIVEN_SAMPLES), 1)]
    scale = of_one.response.scale
    response = GivenResponse(
        given.structure(part, further), (), records, scale, given=given, part=part, further=further
    )
    rows, _, _ = next(iter(response.linearise(theta, 0)))

    def y(at: FloatArray) -> FloatArray:
        return response.simulate(response.values(at), records[0].u).y

    for i in range(len(theta)):
        step = 1e-6 * np.eye(len(theta))[i]
        numeric = (y(theta + step) - y(theta - step)) / 2e-6
        np.testing.assert_allclose(rows[i], numeric, atol=2e-3 * max(np.abs(numeric).max(), 1e-9))


def test_at_its_nominal_values_it_is_the_model(of_one: GivenFit) -> None:
    axis = model()
    given = GivenModel.of(axis, 1e-6)
    response = of_one.response
    y = response.simulate(response.values(np.zeros(given.size)), command(GIVEN_SAMPLES, 3)).y
    np.testing.assert_allclose(y, axis.simulate(command(GIVEN_SAMPLES, 3)).y, atol=1e-10)


def test_modes_move_to_where_their_names_say() -> None:
    """At any coordinates the sections' poles have the frequencies and damping of `named`."""
    given = GivenModel.of(model(), 1e-6)
    theta = 0.2 * np.random.default_rng(4).standard_normal(given.size)
    a1, a2 = given.cascade(theta, False, False).sections[:2]
    s = np.log(a1 / 2 + 1j * np.sqrt(a2 - a1**2 / 4)) * RATE
    named = given.named(theta)
    for i in range(len(given.modes)):
        hz, damping = (named[f"mode{i + 1}.{what}"] for what in ("frequency_hz", "damping_ratio"))
        assert np.min(np.abs(s - 2 * np.pi * hz * (-damping + 1j * np.sqrt(1 - damping**2)))) < 1e-9 * hz


def test_a_whole_part_of_a_sample_is_one_more_sample_of_delay(of_one: GivenFit) -> None:
    given = GivenModel.of(model(), 1e-6)
    response = of_one.response
    u = command(GIVEN_SAMPLES, 2)
    late = [replace(response, structure=given.structure(True, False, whole), part=True) for whole in (0, 1)]
    ends = [np.append(np.zeros(given.size), part) for part in (1.0, 0.0)]
    one, other = (r.simulate(r.values(x), u).y for r, x in zip(late, ends, strict=True))
    np.testing.assert_allclose(one, other, atol=1e-4 * np.ptp(other))


def test_an_answer_within_the_sample_has_no_ports() -> None:
    axis = model()
    linear = LinearBlock(np.append(axis.linear.zeros, 0.1), axis.linear.poles, 1e-3, 0)
    while len(linear.zeros) < len(linear.poles):
        linear = replace(linear, zeros=np.append(linear.zeros, 0.1))
    assert not needs_ports(replace(axis, linear=linear))
    with pytest.raises(InputError, match="within the sample"):
        GivenModel.of(replace(axis, linear=linear), 1e-6)


def test_base_is_found_from_limits_far_off() -> None:
    """By a fifth, where a descent on coloured noise would stick."""
    base = best_base(measured((), GIVEN_SAMPLES, (1, 2)), model(-0.28, 0.36, 1.05))
    assert base.values.cascade.lower == pytest.approx(CASCADE.lower, rel=0.02)
    assert base.values.cascade.upper == pytest.approx(CASCADE.upper, rel=0.02)
    assert base.point.rms < 1.1 * SIGMA


def test_nothing_is_found_where_nothing_is() -> None:
    found = search_given(measured((), GIVEN_SAMPLES, (1, 2)), model(-0.37, 0.32, 0.97))
    assert found.nats == {}
    assert found.fit.labels == ()


def test_friction_is_found_and_its_base_held_and_corrected() -> None:
    train, held_out = measured((RUB,), FEW, (1, 2))
    axis = model(-0.37, 0.32, 0.97)
    assert needs_ports(axis)
    case = Case.of_records("case", axis, [train], [held_out])
    found = diagnose_around(case, np.random.default_rng(1), start="rest")
    assert found.verdict.answer == ("friction",)
    assert found.verdict.gap_holdout.closed > 0.8
    assert "no drive train was read back" in " ".join(found.verdict.notes)
    for name, true in (("saturation.upper", 0.3), ("saturation.lower", -0.35)):
        low, high = found.verdict.base[name].hdi94
        assert low - 0.003 < true < high + 0.003
    run = simulate_corrected(found.corrected, held_out.u)
    np.testing.assert_allclose(run.y, found.after, atol=1e-9)


@pytest.mark.slow
def test_more_delay_is_a_gap_of_a_given_model() -> None:
    records = measured((), FEW, (1, 2))
    late = [replace(r, y=np.concatenate([[0.0, 0.0], r.y[:-2]])) for r in records]
    found = search_given(late, model())
    assert tuple(found.nats) == ("transport_delay",)


def test_beside_rounding_no_period_near_its_step_is_looked_for() -> None:
    step = 20 * SIGMA
    rounded = [replace(r, y=step * np.round(r.y / step)) for r in measured((), GIVEN_SAMPLES, (1, 2))]
    base = best_base(rounded, model())
    readings = read_faults(base)
    assert set(readings.nats) == {"encoder_quantization"}
    assert base.response.scale.shortest == 0
    assert reweighted(base, readings).response.scale.shortest == pytest.approx(3 * step, rel=1e-6)


@pytest.mark.slow
def test_every_start_of_every_law_is_followed(rubbed: GivenFit) -> None:
    """No start, followed alone as far as all are at first, is better than what its kind ends with."""
    base = rubbed
    found = every_law(base)
    assert {fit.labels[0] for fit in found} == {"cubic_stiffness", "friction", "backlash", "other"}
    assert max(found, key=lambda fit: fit.score).labels == ("friction",)
    unnamed = [fit.names[0] for fit in found if fit.labels == ("other",)]
    assert len(unnamed) == len(set(unnamed)) > 3
    law = form("backlash", "dynamic")
    (play,) = (fit for fit in found if fit.labels == (law.label,))
    for start in law.starts(base.response.scale):
        alone = base.with_effect(law, start).with_signal(0).descended(4)
        assert play.score >= alone.score
    rubbing = next(fit for fit in found if fit.labels == ("friction",))
    assert {fit.labels[-1] for fit in every_law(rubbing, (RUB.form, law))} == {"backlash"}


def test_errors_of_timing_are_seen_again_under_the_weights_they_ask_for() -> None:
    records = []
    for r in measured((), GIVEN_SAMPLES, (1, 2)):
        late = 6.0 * np.random.default_rng(len(records)).standard_normal(GIVEN_SAMPLES)
        speed = np.gradient(np.convolve(r.y, np.ones(9) / 9, "same"))
        records.append(replace(r, y=r.y + late * speed))
    base = best_base(records, model())
    faults = read_faults(base)
    assert "timing_jitter.sd" in faults.parameters
    under = reweighted(base, faults)
    again = read_faults(under)
    assert again.nats["timing_jitter"] > 0.5 * faults.nats["timing_jitter"]
    assert read_again(base, under, faults, reweighted)[2] is faults
    other_kind = replace(faults, nats={"timing_jitter": 406.0}, parameters={"timing_jitter.share_held": 0.15})
    mended = read_again(base, under, other_kind, reweighted)[2]
    assert mended.parameters.keys() == faults.parameters.keys()
    assert mended.nats["timing_jitter"] < 406.0


@pytest.mark.parametrize("taken_off", [False, True])
def test_a_fault_that_the_last_explanation_does_not_show_is_taken_back(taken_off: bool) -> None:
    """Rounding that noise was added to, seen on the way in what a law left; not where it was taken off."""
    base = best_base(measured((), GIVEN_SAMPLES, (1, 2)), model())
    sound = read_faults(base)
    seen = replace(sound, nats={"encoder_quantization": 94.0}, rounded_first=True, taken_off=taken_off)
    assert read_again(base, base, seen, lambda fit, _: fit)[2].nats == (seen.nats if taken_off else {})


def test_readings_are_looked_at_until_the_weights_show_what_asked_for_them(
    monkeypatch: pytest.MonkeyPatch, of_one: GivenFit
) -> None:
    """A fault of the first look leads to one of the second, and that to none."""
    sound = read_faults(of_one)
    second = replace(sound, nats={"timing_jitter": 65.0}, parameters={"timing_jitter.sd": 0.003})
    looks = [second, sound]
    monkeypatch.setattr(readings, "read_faults", lambda _: looks.pop(0))
    held = replace(sound, nats={"timing_jitter": 406.0}, parameters={"timing_jitter.share_held": 0.15})
    asked: list[dict[str, float]] = []

    def under(fit: GivenFit, faults: Readings) -> GivenFit:
        asked.append(faults.nats)
        return fit

    assert read_again(of_one, of_one, held, under)[2] is sound
    assert asked == [second.nats, second.nats, {}, {}]


def test_steps_within_the_sample_go_with_the_law(rubbed: GivenFit) -> None:
    finer = rubbed.with_effect(RUB.form, (0.02,)).finer()
    assert finer.response.steps == 4
    assert finer.with_mode(3.0, 0.02).response.steps == 4
    assert finer.without("friction").response.steps == 1


def test_noise_of_a_cause_is_sought_where_effects_leave_more(
    rubbed: GivenFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Effects are sought without it first, and alone where they leave white noise or it explains little of
    what they do; what is better beside it is the answer."""
    base = rubbed
    readings, windy = read_faults(base), base.with_cause(SlowNoise(WIND, RATE))
    rubbing = base.with_effect(RUB.form, (0.02,)).descended()
    assert rubbing.noise_order <= 1 < base.noise_order
    assert rubbing.score > windy.score
    asked: list[bool] = []
    plain: list[GivenFit] = []

    def followed(*args: object) -> object:
        causes = len(args) == 3
        asked.append(causes)
        return Trail(rubbing if causes else plain[0], base, base, readings, {}, {})

    monkeypatch.setattr(given_search, "_followed", followed)
    monkeypatch.setattr(given_search, "slow_causes", lambda _: [windy])
    for first, calls in ((rubbing, [False]), (base, [False, True])):
        asked.clear()
        plain[:] = [first]
        found = given_search._extended(base, readings, lambda _: None)
        assert found.fit.labels == ("friction",)
        assert found.rivals == {WIND: windy.score - base.score}
        assert asked == calls
    asked.clear()
    plain[:] = [replace(rubbing, point=replace(rubbing.point, whitener=base.point.whitener))]
    assert given_search._extended(base, readings, lambda _: None).fit.labels == ("friction",)
    assert asked == [False]


@pytest.mark.slow
def test_beside_a_first_label_that_is_too_small_to_be_verified_none_is_sought(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is kept for its verification, which drops it; one that is worth enough is gone on from."""
    steps = {}
    for size in (0.004, 0.05):
        records = measured((Effect(form("command_bias"), np.array([size])),), FEW, (1, 2))
        base = best_base(records, model())
        biased = base.with_effect(form("command_bias"), (0.0,)).descended()
        begun: list[GivenFit] = []

        def trials(fit: GivenFit, _: object, to: GivenFit = biased, seen: list[GivenFit] = begun) -> object:
            seen.append(fit)
            return [to]

        monkeypatch.setattr(given_search, "_trials", trials)
        monkeypatch.setattr(given_search, "shape_beyond", lambda *_: None)
        trail = given_search._followed(base, read_faults(base), lambda _: None)
        assert trail.fit.labels == ("command_bias",)
        steps[bool(trail.fit.score > base.score + 25)] = len(begun)
    assert steps == {False: 1, True: 2}


def test_what_is_slow_is_not_left_to_the_noise() -> None:
    """An error of a limit that an autoregression takes up is explained under white noise."""
    uneven = Effect(form("gain_asymmetry"), np.array([0.12]))
    base = best_base(measured((uneven,), GIVEN_SAMPLES, (1, 2)), model())
    even = base.with_effect(form("gain_asymmetry"), (0.0,))
    moved = even.point.coordinates + 0.3 * np.eye(even.response.size)[1]
    begun = GivenFit(even.response, evaluate(even.response, moved))
    assert begun.noise_order > 1
    better = explained_slowly(begun)
    assert better.noise_order <= 1
    assert better.score >= begun.descended().score
    assert better.values.cascade.upper == pytest.approx(CASCADE.upper, rel=0.02)
    assert explained_slowly(base) is base


@pytest.mark.slow
def test_a_slow_effect_is_begun_under_white_noise() -> None:
    offset = Effect(form("command_bias"), np.array([0.01]))
    base = best_base(measured((offset,), GIVEN_SAMPLES, (1, 2)), model())
    assert base.noise_order > 1
    found = highest(effect_candidates(base, FORMS))
    assert found.labels == ("command_bias",)
    assert found.noise_order <= 1
    assert found.values.effects[0].values[0] == pytest.approx(0.01, rel=0.1)


def test_a_second_harmonic_is_tried_where_the_first_is(of_few: GivenFit) -> None:
    oval = form("encoder_eccentricity", "two harmonics")
    wavenumber = 8 * np.pi / of_few.response.scale.travel
    planted = Effect(oval, np.array([2 * SIGMA, 0.0, wavenumber, 0.0, 4 * SIGMA]))
    base = best_base(measured((planted,), FEW, (1, 2)), model())
    first = base.with_effect(form("encoder_eccentricity"), (0.0, 0.0, wavenumber)).descended()
    begun = with_further_forms([base, first])
    assert [one.names for one in begun] == [(oval.full_name,)] * len(begun)
    assert max(one.score for one in begun) > first.score + 50
    # Of a shape that is nearly all second harmonic that one is found alone, at half of the period.
    planted = Effect(oval, np.array([0.5 * SIGMA, 0.0, wavenumber, 0.0, 6 * SIGMA]))
    base = best_base(measured((planted,), FEW, (1, 2)), model())
    alone = base.with_effect(form("encoder_eccentricity"), (0.0, 0.0, 2 * wavenumber)).descended()
    whole = max(with_further_forms([alone]), key=lambda one: one.score)
    assert whole.values.effects[-1].values[2] == pytest.approx(wavenumber, rel=0.02)
    bias = base.with_effect(form("command_bias"), (0.0,))
    assert with_further_forms([bias]) == []


def test_a_mode_without_damping_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lone tone in the readings has none."""
    tone = [replace(r, y=r.y + 6 * SIGMA * np.sin(0.4 * r.t)) for r in measured((), GIVEN_SAMPLES, (1, 2))]
    base = best_base(tone, model())
    assert further_modes(base) == []
    monkeypatch.setattr(given_moves, "is_a_mode", lambda _: True)
    (undamped,) = further_modes(base)
    n = undamped.response.given.size
    assert undamped.theta[n + 1] == pytest.approx(LIGHTEST)


def test_a_heavy_mode_moves_the_dominant_poles_further_than_a_nominal_model_is_off(of_one: GivenFit) -> None:
    """One coupled to the first mode: its pole moves by a quarter, where the model's is known to 0.035."""
    given = GivenModel.of(model(), 1e-6)
    response = replace(
        of_one.response,
        structure=given.structure(False, True),
        further=True,
    )
    hz = given.modes[0].frequency_hz
    loose = np.zeros(len(given.loose_sd))
    first = 2 * (len(given.pairs) + int(np.sum(given.zeros.imag > 0)))
    loose[first] = np.log(1.25)
    mode = [np.log(0.6 * hz), np.log(0.02), np.log(0.7 * hz), np.log(0.02)]
    values = response.values(np.concatenate([np.zeros(given.size), mode, loose]))
    rng = np.random.default_rng(8)
    records = []
    for seed in (1, 2):
        y = response.simulate(values, command(GIVEN_SAMPLES, seed)).y
        records.append(record(y + SIGMA * rng.standard_normal(len(y)), seed))
    (found,) = further_modes(best_base(records, model()))
    assert found.noise_order <= 1
    assert found.point.rms < 1.05 * SIGMA
    assert np.exp(found.theta[given.size]) == pytest.approx(0.6 * hz, rel=0.05)


@pytest.mark.parametrize(
    ("memory", "size", "kept"), [(0.0, 0.0065, True), (0.6, 0.02, False), (0.5, 0.016, True)]
)
def test_beside_noise_of_higher_order_a_label_must_be_worth_more(
    memory: float, size: float, kept: bool
) -> None:
    """Nats that are enough on white noise are not where an autoregression is left; they are where a label
    takes most of one away."""
    records = measured((Effect(form("command_bias"), np.array([size])),), FEW, (1, 2))
    rng = np.random.default_rng(5)
    slow = [lfilter([1.0], [1.0, 0.0, 0.0, -memory], SIGMA * rng.standard_normal(FEW)) for _ in records]
    records = [replace(r, y=r.y + 2 * memory * e) for r, e in zip(records, slow, strict=True)]
    base = best_base(records, model())
    fit = base.with_effect(form("command_bias"), (0.0,)).descended()
    assert 25 < fit.score - base.score < 80
    assert (fit.noise_order > 1) == (memory > 0)
    assert leaves_a_cause(fit) == (memory == 0.6)
    nats = verified(fit, base, read_faults(base), lambda _: None)[1]
    assert bool(nats) == kept


def test_long_records_are_begun_by_their_beginnings(of_two: GivenFit) -> None:
    base = of_two
    assert laws_of_states._beginning(base) is base
    with pytest.MonkeyPatch.context() as few:
        few.setattr(laws_of_states, "BEGUN_SAMPLES", GIVEN_SAMPLES)
        short = laws_of_states._beginning(base)
    assert [len(r) for r in short.response.records] == [GIVEN_SAMPLES // 2] * 2
    whole = short.on_records_of(base)
    assert whole.response.records is base.response.records
    assert whole.score == pytest.approx(base.score)
