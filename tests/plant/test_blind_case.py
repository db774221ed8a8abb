"""A case carries what its truth says, at the size it says, and looks as its kind says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant_axes import an_axis

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.case import RefittedGap, make_case
from bayes_hw.plant.effects import OFF_CATALOGUES
from bayes_hw.plant.excitation import FAMILIES
from bayes_hw.plant.kinds import KINDS, LABELS
from bayes_hw.plant.nominal import nominal_of, refit

SHORT = replace(KINDS["easy"], durations_s=(60.0,))


@pytest.mark.parametrize(
    "label",
    [
        "friction",
        *(
            pytest.param(label, marks=pytest.mark.slow)
            for label in ("transport_delay", "encoder_eccentricity", "gain_drift")
        ),
    ],
)
def test_gap_is_what_a_refit_leaves(label: str) -> None:
    """A refit of the finished records from the true base leaves about the gap; the noise is sigma."""
    case = make_case(3, 1, SHORT, [label])
    sigma = case.truth["base"]["noise.sigma"]  # type: ignore[index]
    (gap,) = case.truth["gap_over_sigma"]  # type: ignore[misc]
    assert 1.4 < gap < 6.4
    left = case.truth["gap_rms"]["train"] / sigma  # type: ignore[index]
    assert left == pytest.approx(gap, rel=0.2)
    noise = np.concatenate([r.measured - r.without_noise for r in case.train])
    assert np.std(noise) == pytest.approx(sigma, rel=0.05)


def test_gap_of_a_weak_fault_does_not_depend_on_a_strong_one_tried_before() -> None:
    """A command ramped almost to rest bends the simulator; without the ramp nothing may be left."""
    true = nominal_of(an_axis(1))
    commands = [FAMILIES["steps_and_triangles"](np.random.default_rng(5), true.sample_rate_hz, 2400)]
    ramped = [slowed(true.simulate(u)) for u in commands]
    gap = RefittedGap(true, commands, lambda ramp: ramped if ramp else [true.simulate(u) for u in commands])
    assert gap(1.0) > 0.1
    assert gap(0.0) < 1e-9


def slowed(outputs: FloatArray) -> FloatArray:
    """The same curve at a third of its pace, half as high and upside down."""
    return -0.5 * np.interp(np.arange(len(outputs)) / 3, np.arange(len(outputs)), outputs)


def test_without_a_fault_the_true_model_leaves_the_noise() -> None:
    case = make_case(3, 2, SHORT, [])
    assert case.truth["gap_rms"]["train"] < 1e-6  # type: ignore[index]
    for record in (*case.train, case.holdout):
        np.testing.assert_array_equal(record.noise_free, record.without_noise)


@pytest.mark.slow
def test_a_missing_mode_is_no_matter_of_other_base_frequencies() -> None:
    """From modes begun elsewhere a refit leaves no less: the gap is the fault's, not the search's."""
    case = make_case(1880, 1, SHORT, ["unmodelled_mode"])
    true = case.simulator.with_vector(np.array(list(case.truth["base"].values())[:8]))  # type: ignore[attr-defined]
    commands, outputs = [r.command for r in case.train], [r.without_noise for r in case.train]
    for factors in ((0.85, 1.0), (1.0, 0.85), (1.15, 1.0), (1.0, 1.15)):
        start = true.with_vector(true.vector() * np.array([1, 1, 1, 1, factors[0], 2, factors[1], 2]))
        found = refit(true, commands, outputs, start)
        errors = [found.simulate(u) - y for u, y in zip(commands, outputs, strict=True)]
        assert np.sqrt(np.mean(np.square(errors))) > 0.9 * case.truth["gap_rms"]["train"]  # type: ignore[index]


def test_modes_of_slowly_sampled_axes_stay_below_half_the_sample_rate() -> None:
    kind = replace(KINDS["wide"], rates_hz=(10.0,), durations_s=(60.0,))
    for index in range(6):
        case = make_case(1880, index, kind, [])
        assert max(frequency for frequency, _ in case.simulator.modes) < 0.5 * 10.0


@pytest.mark.slow
def test_pair_carries_both() -> None:
    case = make_case(3, 3, SHORT, ["outliers", "command_bias"])
    assert case.truth["effects"] == ["outliers", "command_bias"]
    assert any(np.abs(r.without_noise - r.noise_free).max() > 0 for r in case.train)


@pytest.mark.slow
def test_same_arguments_same_case_and_other_index_another() -> None:
    first, again, other = (make_case(3, index, SHORT, ["wind"]) for index in (4, 4, 5))
    np.testing.assert_array_equal(first.holdout.measured, again.holdout.measured)
    assert first.truth == again.truth
    assert first.truth["base"] != other.truth["base"]


@pytest.mark.slow
def test_unseen_faults_are_drawn_only_where_a_kind_asks_for_them() -> None:
    names = {
        key: {fault.__module__.rsplit(".", 1)[-1] for fault in faults}
        for key, faults in OFF_CATALOGUES.items()
    }
    assert names == {"known": {"off_catalogue"}, "second": {"second_group"}, "unseen": {"unseen"}}
    assert all(kind.off_catalogue == "known" for kind in KINDS.values())
    details = {}
    for key in OFF_CATALOGUES:
        case = make_case(3, 8, replace(SHORT, off_catalogue=key, durations_s=(30.0,)), ["other"])
        assert case.truth["effects"] == ["other"]
        details[key] = case.truth["detail"]
    assert len({tuple(detail) for detail in details.values()}) == len(OFF_CATALOGUES)


def test_coloured_noise_has_the_correlation_of_the_truth() -> None:
    kind = replace(KINDS["hard"], coloured_share=1.0, durations_s=(200.0,))
    case = make_case(3, 6, kind, [])
    noise = np.concatenate([r.measured - r.without_noise for r in case.train])
    found = np.corrcoef(noise[1:], noise[:-1])[0, 1]
    assert found == pytest.approx(case.truth["rho"], abs=0.05)


@pytest.mark.parametrize("name", list(KINDS))
def test_labels_are_drawn_in_the_stated_shares(name: str) -> None:
    """Over 4,000 draws, each share within four of its standard deviations; every label occurs."""
    kind, rng = KINDS[name], np.random.default_rng(1)
    drawn = [kind.draw_labels(rng) for _ in range(4000)]
    shares = {
        "none": (sum(labels == [] for labels in drawn), kind.none_share),
        "other": (sum(labels == ["other"] for labels in drawn), kind.other_share),
        "pair": (sum(len(labels) == 2 for labels in drawn), kind.pair_share),
    }
    for count, share in shares.values():
        assert abs(count - 4000 * share) < 4 * np.sqrt(4000 * share * (1 - share))
    assert {label for labels in drawn for label in labels} == {*LABELS, "other"}
    assert all(len(set(labels)) == len(labels) for labels in drawn)


def test_nominal_models_are_off_as_the_formats_say() -> None:
    """Spread of 1,500 nominal models: limits 6 %, half width 50, gain 5, frequency 2.5, damping 30 %."""
    kind, rng = KINDS["hard"], np.random.default_rng(2)
    case = make_case(3, 7, SHORT, [])
    ratios = np.array(
        [kind.misjudge(rng, case.simulator).vector() / case.simulator.vector() for _ in range(1500)]
    )
    spread = np.log(ratios).std(axis=0)
    np.testing.assert_allclose(spread, [0.06, 0.06, 0.5, 0.05, 0.025, 0.3, 0.025, 0.3], rtol=0.1)


@pytest.mark.parametrize("name", list(FAMILIES))
@pytest.mark.parametrize(("rate", "seconds"), [(10.0, 60.0), (200.0, 30.0)])
def test_excitations_have_their_length_and_a_sane_size(name: str, rate: float, seconds: float) -> None:
    command = FAMILIES[name](np.random.default_rng(5), rate, round(rate * seconds))
    assert command.shape == (round(rate * seconds),)
    assert 0.15 < np.abs(command).max() < 4.0
    assert np.isfinite(command).all()
