"""Several starts leave a wrong minimum, and say how many of them agreed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_axis import commands, known_axis, simulated_records

from bayes_hw.identify.output_error import fit_output_error
from bayes_hw.identify.several_starts import fit_from_several_starts
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

TRUTH = known_axis()
RNG = np.random.default_rng(5)
RECORDS = simulated_records(TRUTH, commands(RNG, 2, 0.3, 40.0), RNG, sigma=0.005)
NOMINAL = replace(
    TRUTH,
    saturation=Saturation(-0.33, 0.40),
    dead_zone=DeadZone(0.03),
    linear=replace(TRUTH.linear, gain=1.05 * TRUTH.linear.gain),
)


def test_one_descent_recovers_the_parameters() -> None:
    axis = AxisParameters(TRUTH)
    fit = fit_output_error(axis, RECORDS, axis.nominal * 1.01)
    sd = np.sqrt(np.diag(np.linalg.inv(fit.information))) * fit.rms
    coordinates = np.log(np.abs(axis.nominal))
    assert np.all(np.abs(fit.coordinates - coordinates) < 4 * sd)
    assert fit.rms == pytest.approx(0.005, rel=0.05)


def test_the_best_start_reaches_the_noise_and_starts_agree() -> None:
    axis = AxisParameters(NOMINAL)
    several = fit_from_several_starts(axis, RECORDS, rng=np.random.default_rng(0), starts=6)
    assert several.sums_of_squares.shape == (6,)
    assert several.best.residuals @ several.best.residuals == several.sums_of_squares.min()
    assert several.best.rms == pytest.approx(0.005, rel=0.05)
    assert 2 <= several.agreeing <= 6


def test_the_same_seed_gives_the_same_starts() -> None:
    axis = AxisParameters(NOMINAL)
    first, second = (
        fit_from_several_starts(axis, RECORDS, rng=np.random.default_rng(3), starts=3) for _ in range(2)
    )
    np.testing.assert_array_equal(first.sums_of_squares, second.sums_of_squares)


PRACTICE = Path(__file__).resolve().parents[3] / "shared" / "practice_hard"


@pytest.mark.skipif(not PRACTICE.is_dir(), reason=f"{PRACTICE} is absent")
def test_a_case_whose_nominal_start_ends_in_a_wrong_minimum() -> None:
    case = PRACTICE / "case_022"
    truth = json.loads((PRACTICE / "truth" / "case_022.json").read_text(encoding="utf-8"))["base"]
    records = [Record.read(case / f"train_{number}.csv") for number in (1, 2, 3)]
    axis = AxisParameters(HammersteinWiener.read(case / "model.json"))
    several = fit_from_several_starts(axis, records, rng=np.random.default_rng(0))
    assert several.sums_of_squares[0] > 10 * several.sums_of_squares.min()
    assert several.best.rms == pytest.approx(truth["sigma"], rel=0.05)
    assert several.best.values[1] == pytest.approx(truth["saturation.upper"], rel=0.01)
