"""An observer is the Kalman filter that it is taken for, and measures a gap through motion that is lost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drive_axis import (
    LOAD_TORQUE,
    MOTOR_TORQUE,
    RATE,
    SIGMA,
    TRAIN,
    V,
    W,
    command,
    held,
    hypothesis,
    white,
)
from fitted import AXIS, noisy
from own_simulators import motor
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.blind.make import write_case
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.diagnosis import diagnose
from bayes_hw.gap.effects.drive import DynamicBacklash
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.friction import CoulombFrictionAtMotor
from bayes_hw.gap.effects.input import CommandBias, GainDrift, RateLimit
from bayes_hw.gap.effects.linear import CubicStiffness
from bayes_hw.gap.fit.explanation import CHAOS_MARGIN, Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, evaluated, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.following import Following, observer
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder
from bayes_hw.model.blocks import Saturation
from bayes_hw.plant.case import make_case
from bayes_hw.plant.kinds import KINDS
from bayes_hw.record import Record

INPUTS = [command(900, 1), command(900, 2)]
PLAIN = Plain(SIGMA)
BASE = hypothesis(AXIS, INPUTS)
NOMINAL = BASE.builder.axis.nominal
EFFECTS: tuple[Effect, ...] = (DynamicBacklash(), RateLimit(), CommandBias())
HALF_GAP, RATE_LIMIT, SPRING = 0.012, 1.2, 5e5

STRUCK = frozenset(
    [
        "unmodelled_mode",
        "cubic_stiffness",
        "friction",
        "torque_ripple",
        "wind",
        "sensor_drift",
        "timing_jitter",
        "transport_delay",
        "encoder_eccentricity",
        "gain_asymmetry",
        "gain_drift",
        "saturation_drift",
    ]
)
"""Left out for speed."""


def following(measured: list[FloatArray], effects: tuple[Effect, ...] = EFFECTS) -> Following:
    return Following(BASE, measured, effects, PLAIN, Each(1))


def origins(measured: list[FloatArray]) -> list[Fit]:
    """The nominal model and the base model fitted: without the gap its modes move far."""
    return [fit(BASE, measured, BASE.prior_means, PLAIN, iterations) for iterations in (0, 25)]


def begun(effect: Effect, values: tuple[float, ...], origin: Fit) -> Fit:
    """`effect` at `values` beside the base parameters of `origin`."""
    found = BASE.with_effect(effect)
    return evaluated(found, origin.measured, found.to_coordinates(np.append(origin.values, values)), PLAIN)


def driven(torsion: float, samples: int) -> tuple[Hypothesis, list[FloatArray], FloatArray]:
    """The base model, the output beside it of a torque in the gear that is white in samples, and w."""
    a, b, c = TRAIN.state_space()
    ad, bd = held(a, b, 1 / RATE)
    in_gear = (TRAIN.kl * bd[:, LOAD_TORQUE] - TRAIN.km * bd[:, MOTOR_TORQUE])[:, None]
    base = hypothesis(AXIS, [command(samples, 3)])
    v = np.concatenate([[0.0], AXIS.saturation(base.inputs[0])[:-1]])
    system = signal.StateSpace(ad, np.hstack([bd[:, [V]], in_gear]), c[[W]], np.zeros((1, 2)), dt=1 / RATE)
    w = signal.dlsim(system, np.column_stack([v, white(samples, torsion, 5)]))[1][:, 0]
    return base, noisy([AXIS.dead_zone(w)]), w


@pytest.mark.parametrize("torsion", [0.5 * SIGMA, 2 * SIGMA])
def test_of_a_linear_axis_it_is_the_kalman_filter(torsion: float) -> None:
    """Innovations are white and as large as the filter says; without it the residuals are neither."""
    base, measured, w = driven(torsion, 6000)
    followed = observer(base, NOMINAL, torsion, measured, SIGMA)
    assert followed is not None
    y = replace(base, followed=followed).simulate(NOMINAL)[0]
    outside = np.abs(w) > 0.03
    left = (measured[0] - y)[outside]
    assert np.std(left) == pytest.approx(followed.spread * SIGMA, rel=0.03)
    pairs = outside[1:] & outside[:-1]
    e = measured[0] - y
    assert abs(np.corrcoef(e[1:][pairs], e[:-1][pairs])[0, 1]) < 0.05
    free = measured[0] - base.simulate(NOMINAL)[0]
    assert np.std(free[outside]) > 1.05 * np.std(left)


def test_no_gain_follows_nothing_and_readings_that_are_none_do_nothing() -> None:
    measured = [np.full(900, 5.0), np.full(900, -5.0)]
    followed = observer(BASE, NOMINAL, SIGMA, measured, SIGMA)
    assert followed is not None
    free = BASE.simulate(NOMINAL)
    still = replace(BASE, followed=replace(followed, gains=0 * followed.gains)).simulate(NOMINAL)
    for value in (np.inf, np.nan):
        nothing = [np.full(900, value), np.full(900, value)]
        missing = replace(BASE, followed=replace(followed, measured=nothing)).simulate(NOMINAL)
        for y, one, other in zip(free, still, missing, strict=True):
            assert one == pytest.approx(y, abs=1e-9) and other == pytest.approx(y, abs=1e-9)
    drawn = replace(BASE, followed=followed).simulate(NOMINAL)
    assert all(np.max(np.abs(y - z)) > SIGMA for y, z in zip(free, drawn, strict=True))


def test_other_commands_are_simulated_free() -> None:
    followed = replace(BASE, followed=observer(BASE, NOMINAL, SIGMA, [np.zeros(900)] * 2, SIGMA))
    other = [command(900, 8)]
    assert followed.simulate(NOMINAL, other)[0] == pytest.approx(BASE.simulate(NOMINAL, other)[0], abs=1e-12)


def test_a_simulator_of_the_users_is_not_followed() -> None:
    base = Hypothesis(SimulatorBuilder(motor()), BASE.scale, INPUTS)
    assert observer(base, base.to_values(base.prior_means), SIGMA, INPUTS, SIGMA) is None


@pytest.fixture(scope="module")
def gap() -> tuple[list[FloatArray], list[Fit]]:
    """Records of an axis with a gap, and base fits."""
    measured = noisy(hypothesis(AXIS, INPUTS, DynamicBacklash()).simulate(np.append(NOMINAL, HALF_GAP)))
    return measured, origins(measured)


@pytest.fixture(scope="module")
def alone(gap: tuple[list[FloatArray], list[Fit]]) -> Explanation:
    """The gap, followed by itself."""
    measured, bases = gap
    (found,) = following(measured).found(bases, [begun(DynamicBacklash(), (HALF_GAP,), bases[0])])
    return found


@pytest.fixture(scope="module")
def spring() -> tuple[list[FloatArray], list[Fit], Following]:
    """Records of an axis with a cubic spring of SPRING, base fits, and the search that has this effect."""
    measured = noisy(BASE.with_effect(CubicStiffness()).simulate(np.append(NOMINAL, SPRING)))
    return measured, origins(measured), following(measured, (CubicStiffness(),))


def test_the_gap_is_measured(gap: tuple[list[FloatArray], list[Fit]], alone: Explanation) -> None:
    """Its size and the encoder's noise, by errors a fraction of what the base model leaves."""
    measured, bases = gap
    (found,) = following(measured).found(bases, [begun(CommandBias(), (0.01,), bases[0])])
    assert alone.log_evidence == found.log_evidence
    assert found.labels == ("backlash",) and found.chaotic_response and found.stochastic is None
    assert found.fit.values[-1] == pytest.approx(HALF_GAP, rel=0.1)
    assert found.encoder_sigma == pytest.approx(SIGMA, rel=0.2)
    base_rmse = float(np.sqrt(np.mean(np.concatenate(bases[1].residuals) ** 2)))
    assert found.fit.rmse < 0.5 * base_rmse
    free = replace(found.fit.hypothesis, followed=None).simulate(found.fit.values)
    for y, s, e in zip(measured, free, found.fit.free_residuals, strict=True):
        assert y - s == pytest.approx(e)


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect, values",
    [
        (CubicStiffness(), (5e4,)),
        (CoulombFrictionAtMotor(), (30.0, 0.01)),
    ],
)
def test_no_gap_is_found_where_there_is_another_effect(effect: Effect, values: tuple[float, ...]) -> None:
    """An observer corrects whatever is missing: what counts is the lead over others followed alike."""
    with_it = BASE.with_effect(effect)
    measured = noisy(with_it.simulate(np.append(NOMINAL, values)))
    true = fit(with_it, measured, with_it.to_coordinates(np.append(NOMINAL, values)), PLAIN)
    bases = origins(measured)
    assert bases[1].cost > true.cost + 40
    rivals = [true, begun(DynamicBacklash(), (HALF_GAP,), bases[0])]
    found = following(measured, (*EFFECTS, effect)).found(bases, rivals)
    assert [e for e in found if "backlash" in e.labels] == []


def test_nor_where_a_torque_drives_the_gear() -> None:
    base, measured, _ = driven(2 * SIGMA, 1800)
    search = Following(base, measured, EFFECTS, PLAIN, Each(1))
    own = fit(base, measured, base.prior_means, PLAIN)
    gap = base.with_effect(DynamicBacklash())
    rival = evaluated(gap, measured, gap.to_coordinates(np.append(own.values, HALF_GAP)), PLAIN)
    assert search.found([own], [rival]) == []


@pytest.mark.slow
def test_a_second_effect_is_found_beside_the_gap() -> None:
    both = hypothesis(AXIS, INPUTS, DynamicBacklash(), RateLimit())
    measured = noisy(both.simulate(np.concatenate([NOMINAL, (HALF_GAP, RATE_LIMIT)])))
    search = following(measured)
    bases = origins(measured)
    (alone,) = search.found(bases, [begun(DynamicBacklash(), (HALF_GAP,), bases[0])])
    found = search.partners(alone)
    best = max(found, key=lambda e: e.log_evidence)
    assert best.labels == ("backlash", "rate_limit")
    assert best.log_evidence > alone.log_evidence + CHAOS_MARGIN
    assert best.fit.values[-2:] == pytest.approx((HALF_GAP, RATE_LIMIT), rel=0.15)
    assert search.partners(best) == []


WARM = (0.3, 8.0)


@pytest.mark.parametrize("half_gap", [HALF_GAP, 0.0], ids=["a gap", "none"])
def test_beside_an_effect_that_drives_it_the_gap_is_followed(half_gap: float) -> None:
    """Followed alone it is no better than noise: what the other effect does is lost to the corrections."""
    drifting = BASE.with_effect(GainDrift())
    both = drifting.with_effect(DynamicBacklash()) if half_gap else drifting
    measured = noisy(both.simulate(np.concatenate([NOMINAL, WARM, *[[half_gap]] * bool(half_gap)])))
    host = fit(drifting, measured, drifting.to_coordinates(np.append(NOMINAL, WARM)), PLAIN)
    search = following(measured, (DynamicBacklash(), GainDrift()))
    assert search.found(origins(measured), [host]) == []
    found = search.beside([host])
    assert [e.labels for e in found] == [("backlash", "gain_drift"), ("backlash",)] * bool(half_gap)
    for pair, alone in zip(found[::2], found[1::2], strict=True):
        assert pair.log_evidence > alone.log_evidence + CHAOS_MARGIN
        change, _, size = pair.fit.values[-3:]
        assert (change, size) == pytest.approx((WARM[0], half_gap), rel=0.1)
        assert pair.encoder_sigma == pytest.approx(SIGMA, rel=0.25)


def test_an_effect_that_is_not_there_drives_no_gap(gap: tuple[list[FloatArray], list[Fit]]) -> None:
    """The gap alone, from where both ended, is no less likely."""
    measured, _ = gap
    drifting = BASE.with_effect(GainDrift())
    host = evaluated(drifting, measured, drifting.to_coordinates(np.append(NOMINAL, (0.05, 8.0))), PLAIN)
    pair, alone = following(measured, (DynamicBacklash(), GainDrift())).beside([host])
    assert pair.labels == ("backlash", "gain_drift") and alone.labels == ("backlash",)
    assert pair.log_evidence < alone.log_evidence + 10
    assert alone.fit.values[-1] == pytest.approx(HALF_GAP, rel=0.15)


def test_only_a_spring_that_is_among_the_leading_effects_is_followed(
    spring: tuple[list[FloatArray], list[Fit], Following],
) -> None:
    _, bases, search = spring
    assert search.found(bases, [begun(CommandBias(), (0.01,), bases[0])]) == []


def test_from_where_it_was_followed_it_is_fitted_free(
    spring: tuple[list[FloatArray], list[Fit], Following],
) -> None:
    measured, bases, search = spring
    (found,) = search.found(bases, [begun(CubicStiffness(), (5e4,), bases[0])])
    free = search.set_free(found.fit)
    with_it = BASE.with_effect(CubicStiffness())
    truth = evaluated(with_it, measured, with_it.to_coordinates(np.append(NOMINAL, SPRING)), PLAIN)
    assert free.hypothesis.followed is None and free.cost < truth.cost
    assert free.values[-1] == pytest.approx(SPRING, rel=0.1)


@pytest.mark.slow
def test_a_spring_that_jumps_is_followed(tmp_path: Path) -> None:
    """On an axis of the project's own generator whose plain fits of the right effect all end far off."""
    drawn = make_case(1991, 13, KINDS["easy"])
    assert drawn.truth["effects"] == ["cubic_stiffness"]
    write_case(drawn, tmp_path / "case")
    case = Case.read(tmp_path / "case")
    measured = [record.y for record in case.train]
    base = hypothesis(case.model, [record.u for record in case.train], sigma=case.model.noise_sigma)
    plain = Plain(case.model.noise_sigma)
    bases = [fit(base, measured, base.prior_means, plain, iterations) for iterations in (0, 25)]
    cubic = base.with_effect(CubicStiffness())
    begun_at = [
        cubic.to_coordinates(np.append(bases[0].values, s)) for s in CubicStiffness().starts(base.scale)
    ]
    with np.errstate(all="ignore"):
        alone = min((fit(cubic, measured, at, plain) for at in begun_at), key=lambda f: f.cost)
        (found,) = Following(base, measured, (CubicStiffness(),), plain, Each(1)).found(bases, [alone])
    assert found.labels == ("cubic_stiffness",) and found.cannot_be_predicted and not found.chaotic
    assert found.log_evidence > with_coloured_noise(alone, measured).log_evidence + 1000
    assert found.encoder_sigma == pytest.approx(drawn.truth["base"]["sigma"], rel=0.2)


def test_no_second_effect_earns_its_place_beside_a_gap_alone(
    gap: tuple[list[FloatArray], list[Fit]], alone: Explanation
) -> None:
    found = following(gap[0]).partners(alone)
    single = max(e.log_evidence for e in [alone, *found] if e.labels == ("backlash",))
    assert all(e.log_evidence < single + CHAOS_MARGIN for e in found)


def test_what_is_not_followed_is_its_own_free_simulation() -> None:
    at = evaluated(BASE, noisy(BASE.simulate(NOMINAL)), BASE.to_coordinates(NOMINAL), PLAIN)
    assert at.free_residuals is at.residuals
    assert at.free_residuals[0] == pytest.approx(at.residuals[0])


@pytest.mark.slow
def test_what_cannot_be_predicted_is_predicted_by_the_mean_of_the_draws() -> None:
    """Of a whole diagnosis: nearer than the best single simulation, and the band holds what it says."""
    commands = [command(700, seed) for seed in (1, 2, 3)]
    outputs = noisy(hypothesis(AXIS, commands, DynamicBacklash()).simulate(np.append(NOMINAL, 0.06)))
    records = [
        Record(f"r{i}", np.arange(700) / RATE, u, y, RATE, AXIS.units)
        for i, (u, y) in enumerate(zip(commands, outputs, strict=True))
    ]
    linear = replace(AXIS.linear, gain=1.03 * AXIS.linear.gain)
    nominal = replace(AXIS, linear=linear, saturation=Saturation(-0.31, 0.31))
    case = Case.of_records("gap", nominal, records[:2], records[2:])
    found = diagnose(case, np.random.default_rng(1), without=STRUCK)
    assert found.verdict.answer == ("backlash",)
    best = found.decision.explanation.fit
    assert best.hypothesis.followed is not None
    y, (alone,) = outputs[2], best.hypothesis.simulate(best.values, commands[2:])
    assert np.std(y - found.after) < np.std(y - alone)
    assert 0.88 < np.mean((found.low <= y) & (y <= found.high)) < 0.995
    assert found.verdict.gap_holdout.closed_hdi94[0] > 0.5
