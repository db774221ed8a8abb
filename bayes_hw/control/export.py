"""What `design` found as files: design.json, design.mat and the tuned controllers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from bayes_hw.arrays import FloatArray
from bayes_hw.control.allowance import CrossoverCurve, NotchRange
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.design import Design, LoopReport
from bayes_hw.control.limit_cycles import CycleCheck
from bayes_hw.control.plant_summary import PlantSummary, Quantity, zeros
from bayes_hw.control.tuning import Tuned, Tuning
from bayes_hw.control.uncertainty import UncertaintySet
from bayes_hw.files import staged, temporary_sibling, write_json
from bayes_hw.infer.summary import highest_density_interval
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SCHEMA = "bayes-hw/design/1"
MARGIN_UNITS = {
    "gain_margin_db": "dB",
    "gain_reduction_db": "dB",
    "phase_margin_deg": "deg",
    "delay_margin_s": "s",
    "modulus_margin": "",
    "bandwidth_hz": "Hz",
    "crossover_hz": "Hz",
    "phase_crossover_hz": "Hz",
}
QUANTILES = (0.03, 0.05, 0.5, 0.95, 0.97)


def write_design(folder: Path, design: Design) -> None:
    """Write design.json, design.mat, and controller_N.json for every tuned controller into `folder`."""
    content, units = design_content(design), design.nominal.units
    with staged(folder) as place:
        write_json(place / "design.json", content)
        with temporary_sibling(place / "design.mat") as path:
            savemat(path, matlab_content(design), long_field_names=True, do_compression=True)
        for tuning in design.tunings:
            path = place / f"controller_{tuning.structure.lower()}_tuned.json"
            tuning.robust.controller.write(path, units.input, units.output)


def design_content(design: Design) -> dict[str, Any]:
    """The content of design.json: plain numbers, with the unit of each stated; null where there is none."""
    settings, units = design.settings, design.nominal.units
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "name": design.posterior.axis.model.name,
        "units": units.to_dict() | {"frequency": "Hz"},
        "model_sample_rate_hz": design.nominal.sample_rate_hz,
        "posterior_converged": design.posterior.converged,
        "free": design.posterior.axis.free,
        "nominal": _nominal_model(design).to_dict(),
        "draws": {
            "count": design.axis.count,
            "parameters": list(design.posterior.names),
            "units": [parameter.unit for parameter in design.posterior.parameters],
            "values": design.values,
        },
        "share": settings.share,
        "requirements": asdict(settings.requirements),
        "interval": "94 % highest-density interval over the draws",
        "axis": _plant(design.plant),
        "notches": [_notch_range(notch) for notch in design.notches],
        "crossovers": [_crossover(curve) for curve in design.crossovers],
        "loops": [_loop(design, loop) for loop in design.loops],
        "uncertainty": [_set(uncertainty, units.input, units.output) for uncertainty in design.sets],
        "tunings": [_tuning(tuning, units.input, units.output) for tuning in design.tunings],
    }
    return _plain(content)


def matlab_content(design: Design) -> dict[str, Any]:
    """The variables of design.mat: structures `nominal`, `draws`, `weights` and `controllers`.

    Gains are output units per input unit, poles and zeros in z (infinite where there are fewer); see the
    field `units` of each. `draws.quantities` holds velocity gain, speeds, resonances, delay and the like.
    """
    nominal, axis = design.nominal, design.axis
    linear = _nominal_model(design).linear
    numerator, denominator = linear.coefficients()
    units = nominal.units.to_dict() | {"frequency": "Hz", "sample_time": "s"}
    common = {"units": units, "sample_time": 1 / nominal.sample_rate_hz}
    frequency = design.plant.frequency_hz
    return {
        "nominal": common
        | _modal(nominal)
        | {
            "zeros": linear.zeros,
            "poles_of_zpk": linear.poles,
            "gain": linear.gain,
            "numerator": numerator,
            "denominator": denominator,
            "frequency_hz": frequency,
            "response": nominal.response(frequency)[0],
        },
        "draws": common
        | _modal(axis)
        | {
            "zeros": zeros(axis),
            "quantities": {
                name.replace(".", "_"): {"draws": draws, "unit": design.plant.quantities[name].unit}
                for name, draws in design.plant.draws.items()
            },
            "frequency_hz": frequency,
            "response": axis.response(frequency),
        },
        "weights": {
            uncertainty.kind: common
            | {
                "share": uncertainty.share,
                "frequency_hz": uncertainty.frequency_hz,
                "floor": uncertainty.floor,
            }
            | {
                f"order{weight.order}": {
                    "numerator": weight.transfer_function()[0],
                    "denominator": weight.transfer_function()[1],
                    "achieved_share": achieved,
                }
                for weight, achieved in zip(uncertainty.weights, uncertainty.achieved, strict=True)
            }
            for uncertainty in design.sets
        },
        "controllers": np.array(
            [_controller(loop, nominal.units.input, nominal.units.output) for loop in design.loops],
            dtype=object,
        ),
    }


def _nominal_model(design: Design) -> HammersteinWiener:
    posterior = design.posterior
    n_axis = len(posterior.axis.parameters)
    model = posterior.axis.to_model(posterior.point_estimate[:n_axis])
    return replace(model, noise_sigma=float(posterior.point_estimate[n_axis]))


def _modal(axis: AxisDraws) -> dict[str, Any]:
    """G = z^-delay (direct + sum residues ./ (z - poles)), a column a draw."""
    return {
        "poles": axis.poles,
        "residues": axis.residues,
        "direct": axis.direct,
        "delay_samples": axis.delay_samples,
        "saturation_lower": axis.lower,
        "saturation_upper": axis.upper,
        "dead_zone_half_width": axis.half_width,
    }


def _controller(loop: LoopReport, input_unit: str, output_unit: str) -> dict[str, Any]:
    content = loop.controller.to_dict(input_unit, output_unit)
    kept = {key: value for key, value in content.items() if value is not None and key != "notches"}
    sections = np.array(loop.controller.sections, dtype=np.float64).reshape(-1, 5)
    return kept | {"filters_b0_b1_b2_a1_a2": sections}


def _plant(plant: PlantSummary) -> dict[str, Any]:
    return {
        "quantities": {name: _quantity(quantity) for name, quantity in plant.quantities.items()},
        "unreached": list(plant.unreached),
        "transport_delay": {
            "value": plant.transport_delay_samples,
            "unit": "samples",
            "note": "fixed by the model, not sampled",
        },
        "equivalent_delay_read_at_hz": plant.equivalent_delay_hz,
        "antiresonances": [
            {
                "frequency_hz": _summary(pair.frequency_hz, pair.nominal_hz),
                "damping_ratio": _summary(pair.damping_ratio, pair.nominal_damping),
            }
            for pair in plant.antiresonances
        ],
        "probability_minimum_phase": plant.minimum_phase,
        "response": {
            "frequency_hz": plant.frequency_hz,
            "nominal_db": plant.nominal_response,
            "lower_db": plant.magnitude_db[0],
            "upper_db": plant.magnitude_db[1],
            "nominal_deg": plant.nominal_phase_deg,
            "lower_deg": plant.phase_deg[0],
            "upper_deg": plant.phase_deg[1],
            "band": "pointwise central 94 %",
        },
    }


def _quantity(quantity: Quantity) -> dict[str, Any]:
    return asdict(quantity)


def _summary(draws: FloatArray, nominal: float) -> dict[str, Any]:
    if np.ptp(draws) == 0:
        return {"nominal": nominal, "mean": float(draws[0]), "sd": 0.0, "hdi94": [float(draws[0])] * 2}
    return {
        "nominal": nominal,
        "mean": float(draws.mean()),
        "sd": float(draws.std()),
        "hdi94": list(highest_density_interval(draws)),
    }


def _notch_range(notch: NotchRange) -> dict[str, Any]:
    return {
        "mode": notch.mode,
        "lower_hz": notch.lower_hz,
        "upper_hz": notch.upper_hz,
        "notch": notch.notch.to_dict(),
    }


def _crossover(curve: CrossoverCurve) -> dict[str, Any]:
    return {
        "filters": curve.filters,
        "allowed_hz": curve.allowed_hz,
        "allowed_gain": curve.allowed_gain,
        "crossover_hz": curve.crossover_hz,
        "share": curve.share,
    }


def _loop(design: Design, loop: LoopReport) -> dict[str, Any]:
    units = design.nominal.units
    return {
        "controller": loop.controller.to_dict(units.input, units.output),
        "probability_stable": loop.probability_stable,
        "probability_margins_met": loop.met(design.settings.requirements),
        "margins": {
            name: margin_summary(getattr(loop.margins, name), getattr(loop.nominal_margins, name)[0], unit)
            for name, unit in MARGIN_UNITS.items()
        },
        "limit_cycles": [_cycle(check, units.output) for check in loop.cycles],
        "responses": {
            response.name: {
                name: margin_summary(values, None, response.units[name])
                for name, values in response.merits.items()
            }
            for response in loop.responses
        },
        "largest_weighted_complementary_sensitivity": list(loop.robustness_peaks),
    }


def margin_summary(draws: FloatArray, nominal: float | None, unit: str) -> dict[str, Any]:
    """Quantiles of a figure of merit over the draws; NaN, of unstable draws, counts as the lowest."""
    ordered = np.where(np.isnan(draws), -np.inf, draws)
    quantiles = {f"q{100 * q:g}": float(np.quantile(ordered, q, method="nearest")) for q in QUANTILES}
    return {"unit": unit, "nominal": nominal, **quantiles}


def _cycle(check: CycleCheck, unit: str) -> dict[str, Any]:
    predicted, simulated = check.predicted, check.simulated
    stays = predicted.stable
    return {
        "place": check.place,
        "probability_predicted": float(np.mean(predicted.has_cycle)),
        "probability_simulated": float(np.mean(simulated.sustained)),
        "simulated_draws": len(simulated.sustained),
        "agreement": check.agreement,
        "frequency_hz": {
            "predicted": _median(predicted.frequency_hz[stays]),
            "simulated": _median(simulated.frequency_hz),
        },
        "position_amplitude": {
            "unit": unit,
            "predicted": _median(predicted.position_amplitude[stays]),
            "simulated": _median(simulated.position_amplitude),
        },
    }


def _median(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")


def _set(uncertainty: UncertaintySet, input_unit: str, output_unit: str) -> dict[str, Any]:
    return {
        "kind": uncertainty.kind,
        "unit": "" if uncertainty.kind == "multiplicative" else f"{output_unit}/({input_unit})",
        "share": uncertainty.share,
        "from_hz": float(uncertainty.frequency_hz[0]),
        "weights": [
            {
                "order": weight.order,
                "numerator": weight.transfer_function()[0],
                "denominator": weight.transfer_function()[1],
                "in": "powers of 1/z, constant term first",
                "achieved_share_fresh_draws": achieved,
                "interval95": list(interval),
                "fresh_draws": uncertainty.fresh_draws,
            }
            for weight, achieved, interval in zip(
                uncertainty.weights, uncertainty.achieved, uncertainty.intervals, strict=True
            )
        ],
    }


def _tuning(tuning: Tuning, input_unit: str, output_unit: str) -> dict[str, Any]:
    def one(tuned: Tuned) -> dict[str, Any]:
        return {
            "controller": tuned.controller.to_dict(input_unit, output_unit),
            "feasible": tuned.feasible,
            "lower_5_percent_bandwidth_hz": tuned.lower_bandwidth_hz,
            "share_breaking_margins": tuned.broken,
        }

    return {
        "structure": tuning.structure,
        "share": tuning.share,
        "over_the_posterior": one(tuning.robust),
        "on_the_point_estimate": one(tuning.point),
    }


def _plain(value: Any) -> Any:
    """Arrays as lists, and null for what is not a finite number."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
