"""What does the printed model of the Nanshan 26 m telescope still say, given four digits a coefficient?

Writes report.html, report.pdf and results.json: the poles as printed, how much of the rounding box is stable,
the representative that the twin uses and how it depends on its one free choice, and what rounding leaves
uncertain.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pages.printed_model_report import Choice, PrintedModel, printed_model_report
from printed.eq12 import (
    PRINTED_DIGITS,
    SLOW_POLE_LIMIT,
    nanshan_rounding_box,
    nanshan_rounding_uncertainty,
    printed_coefficients,
)
from printed.nanshan import SAMPLE_RATE_HZ, nanshan_linear_block, nanshan_model
from printed.representative import find_representative
from printed.rounding_box import LIGHT_DAMPING, RoundingUncertainty, StableShare, roots_of_rows
from study import start_study

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.linear import LinearBlock, polynomial_roots

QUANTILES = (0.0, 0.03, 0.5, 0.97, 1.0)
GAIN_FREQUENCY_HZ = np.append(np.geomspace(0.005, 5.0, 48), 1.0)
SLOW_POLE_LIMITS = (0.985, 0.988, 0.99, SLOW_POLE_LIMIT, 0.993, 0.995)
SHOWN_MEMBERS = 300
READINGS = {"four_digits": PRINTED_DIGITS, "as_printed": None}
DRAWS = 100_000


def main() -> None:
    study = start_study("01_printed_model", __doc__)
    draws = DRAWS // 10 if study.quick else DRAWS
    numerator, denominator = printed_coefficients()
    spreads = {
        name: nanshan_rounding_uncertainty(
            np.random.default_rng([study.seed, index]), draws, GAIN_FREQUENCY_HZ, digits
        )
        for index, (name, digits) in enumerate(READINGS.items())
    }
    choices = tuple(choose(limit) for limit in SLOW_POLE_LIMITS)
    results = {
        "draws": draws,
        "quantiles": QUANTILES,
        "printed": {
            "numerator": numerator.tolist(),
            "denominator": denominator.tolist(),
            "poles": pairs(polynomial_roots(denominator)),
            "zeros": pairs(polynomial_roots(numerator[3:])),
            "value_at_one": {"numerator": numerator.sum(), "denominator": denominator.sum()},
        },
        "representative": describe_representative(nanshan_linear_block()),
        "slow_pole_limits": [describe_choice(choice) for choice in choices],
        "readings": {name: describe_reading(spread) for name, spread in spreads.items()},
    }
    axis = nanshan_model()
    _, members = nanshan_rounding_box().sample(np.random.default_rng([study.seed, 2]), SHOWN_MEMBERS)
    model = PrintedModel(
        box=nanshan_rounding_box(),
        printed_poles=polynomial_roots(denominator),
        box_poles=roots_of_rows(members),
        representative=axis.linear,
        modes=axis.dominant_modes,
        slow_pole_limit=SLOW_POLE_LIMIT,
        choices=choices,
        readings={name.replace("_", " "): spread for name, spread in spreads.items()},
        sample_rate_hz=SAMPLE_RATE_HZ,
        units=axis.units,
    )
    study.write_document(printed_model_report(model, study.origin()))
    study.write_results(results)
    print_table(results)


def describe_representative(block: LinearBlock) -> dict[str, Any]:
    """The kept model: roots, gain, modes, displacement from the printed numbers, velocity gain curve."""
    displacement = nanshan_rounding_box().displacement(*block.coefficients())
    gain = np.abs(block.frequency_response(GAIN_FREQUENCY_HZ, SAMPLE_RATE_HZ))
    modes = nanshan_model().dominant_modes
    return {
        "poles": pairs(block.poles),
        "zeros": pairs(block.zeros),
        "gain": block.gain,
        "delay_samples": block.delay_samples,
        "frequency_hz": [mode.frequency_hz for mode in modes],
        "damping_ratio": [mode.damping_ratio for mode in modes],
        "displacement": {
            "numerator": displacement[0].tolist(),
            "denominator": displacement[1].tolist(),
        },
        "velocity_gain": block.velocity_gain(SAMPLE_RATE_HZ),
        "gain_frequency_hz": GAIN_FREQUENCY_HZ.tolist(),
        "gain_curve": (gain * 2 * np.pi * GAIN_FREQUENCY_HZ).tolist(),
    }


def choose(limit: float) -> Choice:
    """The representative that a limit on the slow poles gives, or why there is none."""
    box = nanshan_rounding_box()
    try:
        block = find_representative(box, limit)
    except InputError as error:
        return Choice(limit, None, float("nan"), str(error))
    displacement = np.concatenate(box.displacement(*block.coefficients()))
    return Choice(limit, block, float(np.abs(displacement).max()))


def describe_choice(choice: Choice) -> dict[str, Any]:
    """A choice for the results file."""
    block = choice.block
    if block is None:
        return {"limit": choice.limit, "refused": choice.refused}
    displacement = np.concatenate(nanshan_rounding_box().displacement(*block.coefficients()))
    modes = [mode for mode in block.modes(SAMPLE_RATE_HZ) if mode.damping_ratio < LIGHT_DAMPING]
    slow = np.sort_complex(block.poles[np.abs(block.poles - 1) < 0.1])[:2]
    return {
        "limit": choice.limit,
        "largest_displacement": choice.largest_displacement,
        "squared_displacement": float(np.sum(displacement**2)),
        "slow_poles": pairs(slow),
        "frequency_hz": [mode.frequency_hz for mode in modes],
        "damping_ratio": [mode.damping_ratio for mode in modes],
        "velocity_gain": block.velocity_gain(SAMPLE_RATE_HZ),
    }


def describe_reading(spread: RoundingUncertainty) -> dict[str, Any]:
    """What rounding leaves uncertain, for the results file."""
    slow = slow_poles(spread)
    return {
        "stable_in_box": share(spread.stable_in_box),
        "stable_integrators": share(spread.stable_integrators),
        "frequency_hz": quantiles(spread.frequency_hz),
        "damping_ratio": quantiles(spread.damping_ratio),
        "slow_pole_modulus": quantiles(np.sort(np.abs(slow), axis=1)),
        "slow_poles_complex": float(np.mean(np.any(slow.imag != 0, axis=1))),
        "velocity_gain": quantiles(spread.velocity_gain[:, None])[0],
        "velocity_gain_negative": float(np.mean(spread.velocity_gain < 0)),
        "gain_at_1_hz": quantiles(spread.gain_curve[:, -1:])[0],
        "gain_frequency_hz": GAIN_FREQUENCY_HZ.tolist(),
        "gain_curve": quantiles(spread.gain_curve),
        "some_slow_poles": [pairs(row) for row in slow[:SHOWN_MEMBERS]],
    }


def slow_poles(spread: RoundingUncertainty) -> ComplexArray:
    """The two poles nearest z = 1 of each member, shape (members, 2)."""
    nearest = np.argsort(np.abs(spread.poles - 1), axis=1)[:, :2]
    return np.take_along_axis(spread.poles, nearest, axis=1)


def quantiles(columns: FloatArray) -> list[list[float]]:
    """QUANTILES of each column."""
    found: list[list[float]] = np.quantile(columns, QUANTILES, axis=0).T.tolist()
    return found


def share(counted: StableShare) -> dict[str, float]:
    return {
        "share": counted.share,
        "standard_error": counted.standard_error,
        "stable": counted.stable,
        "draws": counted.draws,
    }


def pairs(roots: ComplexArray) -> list[list[float]]:
    return [[float(root.real), float(root.imag)] for root in roots]


def print_table(results: dict[str, Any]) -> None:
    largest = max(np.hypot(*pole) for pole in results["printed"]["poles"])
    print(f"largest |pole| as printed: {largest:.4f}")
    kept = results["representative"]
    moved = np.abs(kept["displacement"]["numerator"] + kept["displacement"]["denominator"]).max()
    print(f"representative: farthest coefficient at {moved:.3f} half widths")
    print(f"  resonances {kept['frequency_hz']} Hz, damping {kept['damping_ratio']}")
    print(f"  velocity gain {kept['velocity_gain']:.5f}")
    print("limit of slow poles -> largest displacement, slow poles")
    for choice in results["slow_pole_limits"]:
        text = choice.get("refused") or (f"{choice['largest_displacement']:.3f}, {choice['slow_poles']}")
        print(f"  {choice['limit']:.4f}  {text}")
    header = "  ".join(f"{100 * quantile:7.0f} %" for quantile in results["quantiles"])
    for name, reading in results["readings"].items():
        print(f"\nreading: {name}")
        for key in ("stable_in_box", "stable_integrators"):
            found = reading[key]
            print(f"  {key}: {found['share']:.4f} +- {found['standard_error']:.4f} (binomial)")
        print(f"  negative velocity gain: {reading['velocity_gain_negative']:.3f}")
        print(f"  {'quantile':18s}{header}")
        rows = [
            *(("frequency_hz", row) for row in reading["frequency_hz"]),
            *(("damping_ratio", row) for row in reading["damping_ratio"]),
            *(("slow_pole_modulus", row) for row in reading["slow_pole_modulus"]),
            ("gain at 1 Hz", reading["gain_at_1_hz"]),
            ("velocity_gain", reading["velocity_gain"]),
        ]
        for label, row in rows:
            print(f"  {label:18s}" + "  ".join(f"{value:9.4f}" for value in row))


if __name__ == "__main__":
    main()
