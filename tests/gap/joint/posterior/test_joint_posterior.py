"""Draws about the joint fit are of its structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, RATE, SIGMA, STRUCTURE, form, measured, response_with, scale, torque

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit import chaotic_motion
from bayes_hw.gap.joint.fit.chaotic_motion import drawn_about
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior import joint_posterior
from bayes_hw.gap.joint.posterior.joint_posterior import CHAOTIC, DRAWS, INFLATION, averaged, laplace, nats_of
from bayes_hw.gap.joint.posterior.reported_quantities import (
    dominant_sections,
    effect_quantities,
    effect_units,
    sections_of_modes,
)
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.observer import observed
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Units

SAMPLES = 600


def test_a_pair_that_the_records_do_not_see_stays_a_pair_in_every_draw() -> None:
    """A slow pair of next to no weight, whose poles may be anywhere: draws differ, none has it real."""
    unseen = np.array([[1.9998], [0.99999], [2e-7], [-2e-7]])
    cascade = replace(
        CASCADE, sections=np.hstack([CASCADE.sections, unseen]), starts=np.zeros((1, 5))
    )  # fmt: skip
    response = JointResponse(replace(STRUCTURE, sections=2), (), measured((), SAMPLES, (1,)), scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(cascade))))
    posterior = laplace(fit, Units(), np.random.default_rng(1))
    a1, a2 = np.array([response.values(x).cascade.sections[:2, 1] for x in posterior.coordinates]).T
    assert len(a1) == DRAWS and np.ptp(a1) > 1e-4
    assert np.mean(a1 * a1 / 4 < a2) > 0.99


@pytest.mark.slow
def test_a_mode_is_reported_where_the_records_tell_its_weights_from_none() -> None:
    """A light mode beside the axis' own, of next to no weight and of eight deviations, in a fit that is
    doubted; in one that is not, growth has asked for as much."""
    rng, records = np.random.default_rng(3), measured((), SAMPLES, (1,))
    reported = {}
    for weight in (1e-6, 2e-3):
        light = np.array([[1.76], [0.96], [weight], [-weight]])
        sections = np.hstack([CASCADE.sections, light])
        values = JointValues(replace(CASCADE, sections=sections, starts=np.zeros((1, 5))))
        response = JointResponse(replace(STRUCTURE, sections=2), (), records, scale(SAMPLES))
        noise = SIGMA * rng.standard_normal((len(records), SAMPLES))
        seen = [
            replace(r, y=response.simulate(values, r.u, r.known).y + e)
            for r, e in zip(records, noise, strict=True)
        ]
        response = replace(response, records=seen)
        fit = JointFit(response, evaluate(response, response.coordinates(values)))
        for doubted in (True, False):
            rng = np.random.default_rng(1)
            found = laplace(fit, Units(), rng, sections=[1], doubted=doubted)
            reported[weight, doubted] = found.sections
    assert reported == {(1e-6, True): (), (1e-6, False): (1,), (2e-3, True): (1,), (2e-3, False): (1,)}


def test_what_quantities_are_worth_is_half_of_walds_statistic() -> None:
    drawn = np.random.default_rng(0).standard_normal((4000, 2)) @ np.array([[1.0, 0.5], [0.0, 2.0]])
    covariance = np.array([[1.0, 0.5], [0.5, 4.25]])
    mean = np.array([3.0, -4.0])
    np.testing.assert_allclose(nats_of(mean, drawn), 0.5 * mean @ np.linalg.solve(covariance, mean), rtol=0.1)
    assert nats_of(mean, np.zeros((3, 2)) + mean) > 1e9


def test_a_mode_is_looked_for_among_the_sections_of_another_fit() -> None:
    """Where a descent exchanged two sections, and where it drew one apart into real poles."""
    records = measured((), SAMPLES, (1,))
    pairs = np.array([[1.5, 0.2], [0.9, 0.8], [1e-3, 1e-3], [-8e-4, 0.0]])
    apart = np.array([[1.5, 1.2], [0.9, 0.3], [1e-3, 1e-3], [-8e-4, 0.0]])

    def fit(sections: FloatArray) -> JointFit:
        cascade = replace(CASCADE, sections=sections, starts=np.zeros((1, 5)))
        response = JointResponse(replace(STRUCTURE, sections=2), (), records, scale(SAMPLES))
        return JointFit(response, evaluate(response, response.coordinates(JointValues(cascade))))

    own = fit(pairs)
    assert sections_of_modes(own, [0, 1], own) == [0, 1]
    assert sections_of_modes(own, [0, 1], fit(pairs[:, ::-1])) == [1, 0]
    assert sections_of_modes(own, [0, 1], fit(apart)) == [0]


def test_of_two_modes_that_overlap_the_less_damped_is_dominant() -> None:
    records = measured((), SAMPLES, (1,))

    def numbers(damping: tuple[float, float], hz: tuple[float, float] = (2.0, 2.06)) -> list[int]:
        poles = [
            np.exp(2 * np.pi * f / RATE * (-d + 1j * np.sqrt(1 - d**2)))
            for f, d in zip(hz, damping, strict=True)
        ]
        sections = np.array([[2 * p.real, abs(p) ** 2, 1e-3, -8e-4] for p in poles]).T
        cascade = replace(CASCADE, sections=sections, starts=np.zeros((1, 5)))
        response = JointResponse(replace(STRUCTURE, sections=2), (), records, scale(SAMPLES))
        return dominant_sections(
            JointFit(response, evaluate(response, response.coordinates(JointValues(cascade))))
        )

    assert numbers((0.05, 0.09)) == [0]
    assert numbers((0.09, 0.05)) == [1]
    assert numbers((0.05, 0.05)) == [0]
    assert numbers((0.05, 0.09), (2.0, 4.0)) == [0, 1]


def test_draws_about_a_chaotic_motion_are_ones_that_the_records_allow(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its torques held, a pair that next to nothing is seen of does not carry the axis away."""
    monkeypatch.setattr(chaotic_motion, "EXPLODED", 0.0)
    unseen = np.array([[1.9998], [0.99999], [2e-7], [-2e-7]])
    cascade = replace(CASCADE, sections=np.hstack([CASCADE.sections, unseen]), starts=np.zeros((1, 5)))
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    records = measured((rub,), SAMPLES, (1,))
    ports = replace(
        rub.ports,
        sections=np.hstack([rub.ports.sections, np.zeros((2, 1))]),
        signal_sections=np.hstack([rub.ports.signal_sections, np.zeros((2, 1))]),
    )
    values = JointValues(cascade, (replace(rub, ports=ports),))
    response = JointResponse(replace(STRUCTURE, sections=2), values.effects, records, scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    held, _, where = drawn_about(fit)
    assert held is not fit
    np.testing.assert_allclose(held.point.residuals[0], fit.point.residuals[0], atol=1e-12)
    np.testing.assert_array_equal(held.point.coordinates, fit.point.coordinates[where])
    posterior = laplace(fit, Units(), np.random.default_rng(1))
    drawn, of_the_law = posterior.coordinates, np.setdiff1d(np.arange(response.size), where)
    np.testing.assert_array_equal(
        drawn[:, of_the_law], np.tile(fit.point.coordinates[of_the_law], (DRAWS, 1))
    )
    assert "friction.smoothing_speed" not in posterior.effects
    spread = np.ptp(drawn[:, where], axis=0)
    assert spread[:8].min() > 0 and spread[-6:].min() > 0
    errors = np.array([held.response.residuals(x[where])[0] for x in drawn])
    deviations, size = INFLATION * CHAOTIC, held.response.size
    nats = 0.5 * deviations**2 * (size + 4 * np.sqrt(2 * size))
    assert np.sqrt(np.mean(errors**2, axis=1)).max() < fit.point.rms * np.exp(nats / SAMPLES)


def _overflowing(monkeypatch: pytest.MonkeyPatch, under_its_law: bool, held: bool) -> JointFit:
    """A fit with a torque whose derivatives overflow under its law, under held torques, or both."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    response, values = response_with((rub,), SAMPLES)
    plain = JointFit.factor

    def factor(self: JointFit) -> FloatArray:
        if under_its_law if any(effect.is_own_law for effect in self.response.template) else held:
            raise FloatingPointError("derivatives are not finite")
        return plain(self)

    monkeypatch.setattr(JointFit, "factor", factor)
    return JointFit(response, evaluate(response, response.coordinates(values)))


def test_where_a_torque_makes_derivatives_overflow_it_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    held, found, where = drawn_about(_overflowing(monkeypatch, under_its_law=True, held=False))
    assert not any(effect.is_own_law for effect in held.response.template)
    assert len(found) == held.response.size + 1 == len(where) + 1


def test_an_axis_that_its_law_alone_steadies_is_drawn_about_with_its_law(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Derivatives that overflow under held torques tell nothing."""
    fit = _overflowing(monkeypatch, under_its_law=False, held=True)
    about, factor, where = drawn_about(fit)
    assert about is fit
    assert len(factor) == fit.response.size + 1 == len(where) + 1


def test_derivatives_that_overflow_either_way_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FloatingPointError, match="not finite"):
        drawn_about(_overflowing(monkeypatch, under_its_law=True, held=True))


def test_under_held_torques_a_port_is_told_as_under_its_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """The law looks at the motor's speed, which its torque does not reach: the same derivatives."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    rub = replace(rub, ports=replace(rub.ports, signal=False, signal_sections=np.zeros((2, 1))))
    response = JointResponse(STRUCTURE, (rub,), measured((rub,), SAMPLES, (1, 2)), scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, (rub,)))))
    _, by_the_law, _ = drawn_about(fit)
    monkeypatch.setattr(chaotic_motion, "EXPLODED", 0.0)
    _, held, where = drawn_about(fit)
    own = [i for i, at in enumerate(where) if at >= response.size - 4]
    assert len(own) == 4
    told, under_law = held.T @ held, by_the_law.T @ by_the_law
    np.testing.assert_allclose(told[np.ix_(own, own)], under_law[np.ix_(where[own], where[own])], rtol=1e-6)


def test_torques_are_held_where_readings_correct_the_motion_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """An observer that corrects too little leaves derivatives that grow: the readings go on correcting."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    response = JointResponse(STRUCTURE, (rub,), measured((rub,), SAMPLES, (1, 2)), scale(SAMPLES))
    plain = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, (rub,)))))
    fit = observed(plain)[0]
    assert drawn_about(fit)[0] is fit
    monkeypatch.setattr(chaotic_motion, "EXPLODED", 0.0)
    held, _, where = drawn_about(fit)
    assert held.observer is not None
    assert not any(effect.is_own_law for effect in held.response.template)
    np.testing.assert_array_equal(held.point.coordinates, fit.point.coordinates[where])
    for one, other in zip(held.point.residuals, fit.point.residuals, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_under_held_torques_every_record_is_fitted_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of two lengths, each with weights of its own."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    records = [*measured((rub,), SAMPLES, (1,)), *measured((rub,), 2 * SAMPLES, (2,))]
    weights = tuple(np.full(len(record), 1.0 + number) for number, record in enumerate(records))
    response = replace(JointResponse(STRUCTURE, (rub,), records, scale(SAMPLES)), weights=weights)
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, (rub,)))))
    monkeypatch.setattr(chaotic_motion, "EXPLODED", 0.0)
    held, _, _ = drawn_about(fit)
    assert held is not fit
    for under_torques, under_law in zip(held.point.residuals, fit.point.residuals, strict=True):
        np.testing.assert_allclose(under_torques, under_law, atol=1e-12)


@pytest.mark.parametrize("name", ["torque limit", "slip beyond the spring"])
def test_a_twist_is_stated_as_an_acceleration(name: str) -> None:
    """Laws see it as a second difference over a sample."""
    effect = torque(form("other", name), (2e-5,), 1e-6)
    response, values = response_with((effect,), SAMPLES)
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    assert effect_quantities(fit, values)["other.acceleration"] == pytest.approx(2e-5 * RATE**2)
    assert effect_units(fit, Units())["other.acceleration"] == "deg/s^2"


def test_base_parameters_are_averaged_over_explanations() -> None:
    """Each rival has its share of the draws, where the rival's are; whole rows, not numbers one by one."""
    records = measured((), SAMPLES, (1, 2))
    fits = []
    for lower, upper in ((-0.35, 0.3), (-0.2, 0.15)):
        response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
        values = JointValues(replace(CASCADE, lower=lower, upper=upper))
        fits.append(JointFit(response, evaluate(response, response.coordinates(values))))
    own, rival = (laplace(fit, Units(), np.random.default_rng(1)) for fit in fits)
    mixed = averaged(own, [(rival, 0.3)], np.random.default_rng(2))
    of_rival = mixed.base["saturation.lower"] != own.base["saturation.lower"]
    assert 0.2 < of_rival.mean() < 0.4
    for name in ("saturation.lower", "saturation.upper", "gain"):
        expected = np.where(of_rival, rival.base[name], own.base[name])
        np.testing.assert_array_equal(mixed.base[name], expected)
    assert np.median(rival.base["saturation.lower"]) == pytest.approx(-0.2, abs=0.05)
    assert np.ptp(own.base["saturation.lower"]) < 0.1


def test_draws_that_shrink_onto_the_fit_tell_nothing_of_limits_gap_and_modes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As where a law sticks, so that every step costs more than it should: standard deviations are those of
    the likelihood's curvature all the same."""
    records = measured((), SAMPLES, (1, 2))
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
    wide = laplace(fit, Units(), np.random.default_rng(1), sections=[0])

    def at_the_fit(fit: JointFit, *_: object) -> FloatArray:
        return np.tile(fit.point.coordinates, (DRAWS, 1))

    monkeypatch.setattr(joint_posterior, "_allowed", at_the_fit)
    found = laplace(fit, Units(), np.random.default_rng(1), sections=[0])
    np.testing.assert_array_equal(found.coordinates, np.tile(fit.point.coordinates, (DRAWS, 1)))
    factor = fit.factor()
    size = len(factor) - 1
    variance = float(np.sum(factor[:, size] ** 2)) / fit.point.samples
    expected = joint_posterior.INFLATION * np.sqrt(
        variance * np.diag(np.linalg.inv(factor[:size, :size].T @ factor[:size, :size]))
    )
    names = ("saturation.lower", "saturation.upper")
    np.testing.assert_allclose([np.std(found.base[n]) for n in names], expected[:2], rtol=0.15)
    for name in set(wide.base) - {"gain"}:
        one, other = (float(np.ptp(np.quantile(p.base[name], [0.2, 0.8]))) for p in (found, wide))
        assert one == pytest.approx(other, rel=0.25), name
