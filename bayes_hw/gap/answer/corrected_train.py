"""corrected.json of a given model whose drive train was read back: the model with its base parameters
re-estimated, the answer's effects, and what simulates both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Verdict
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.catalogue import catalogue
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.infer.posterior import extremes
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units

SCHEMA = "bayes-hw/corrected-train/1"
KEY = "train"
"""What a corrected.json of this kind has and others have not."""

DRAWS_KEPT = 600
MOST_DRAWS = 10_000


class TrainSimulation(NamedTuple):
    """Position of the axis and what the encoder shows of it, noise-free, each (samples,)."""

    w: FloatArray
    y: FloatArray


def corrected_train(
    case: Case, final: Explanation, coordinates: FloatArray, verdict: Verdict
) -> dict[str, object]:
    """The content of corrected.json of the explanation `final` of a case, with its posterior draws
    `coordinates` (draws, size)."""
    base, parameters = verdict.base, verdict.parameters
    hypothesis, values = final.fit.hypothesis, final.fit.values
    chains = ChainBuilder(case.model)
    sigma = base[NOISE_SIGMA].mean if NOISE_SIGMA in base else case.model.noise_sigma
    model = replace(
        chains.axis.to_model(values[: hypothesis.base_count]),
        name=f"{case.model.name}, corrected",
        noise_sigma=sigma,
    )
    forms = {effect.label: effect.form for effect in hypothesis.effects}
    found: dict[str, object] = dict(model.to_dict())
    found["effects"] = [
        {
            "label": label,
            "form": forms.get(label, ""),
            "parameters": {
                name.split(".", 1)[1]: estimate.mean
                for name, estimate in parameters.items()
                if name.split(".")[0] == label
            },
        }
        for label in final.labels
    ]
    found["records"] = [{"name": r.name, "sha256": r.sha256} for r in case.train]
    found[KEY] = {
        "schema": SCHEMA,
        "nominal": case.model.to_dict(),
        "scale": asdict(hypothesis.scale),
        "effects": [effect.name for effect in hypothesis.effects],
        "values": values.tolist(),
        "draws": hypothesis.to_values(coordinates[_spread(len(coordinates))]).tolist(),
    }
    found["answer"] = list(verdict.answer)
    found["probability"] = {label: verdict.probability[label] for label in verdict.answer}
    found["motion"] = motion_of(case.train)
    found["next_experiment"] = verdict.next_experiment
    return found


def _spread(count: int) -> IntArray:
    """Rows of `count` draws that are kept, evenly over all."""
    return np.unique(np.linspace(0, count - 1, min(count, DRAWS_KEPT)).astype(np.int64))


def simulate_train(data: Mapping[str, Any], u: FloatArray) -> TrainSimulation:
    """Noise-free response of such a corrected.json to a command (samples,) from rest; raises InputError where
    it is not what diagnose writes."""
    hypothesis, values, _ = hypothesis_of(data, u)
    ((w, y),) = hypothesis.simulate_signals(values)
    return TrainSimulation(w, y)


def predict_train(data: Mapping[str, Any], u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and 94 % band of y (samples,) under a command, parameters and noise both counted."""
    hypothesis, values, draws = hypothesis_of(data, u)
    (mean,) = hypothesis.simulate(values)
    spread = np.zeros_like(mean)
    if len(draws) > 1:
        (drawn,) = hypothesis.simulate_batch(draws)
        low, high = np.quantile(drawn, [0.16, 0.84], axis=1)
        spread = (high - low) / 2
    sigma = float(data.get("noise", {}).get("sigma", 0.0))
    half = NORMAL_HALF_WIDTH * np.sqrt(spread**2 + sigma**2)
    return mean, mean - half, mean + half


def hypothesis_of(data: Mapping[str, Any], u: FloatArray) -> tuple[Hypothesis, FloatArray, FloatArray]:
    """The hypothesis on a command (samples,), with its values (size,) and draws (draws, size); raises
    InputError where `data` is not what diagnose writes."""
    try:
        held = data[KEY]
        scale = held["scale"]
        made = AxisScale(
            **{**scale, "stiffness": tuple(scale["stiffness"]), "units": Units(**scale["units"])}
        )
        effects = tuple(_effect_named(str(name)) for name in held["effects"])
        nominal = HammersteinWiener.from_dict(held["nominal"])
        hypothesis = Hypothesis(ChainBuilder(nominal), made, [u], effects)
        values = np.array(held["values"], dtype=np.float64)
        draws = np.array(held["draws"][:MOST_DRAWS], dtype=np.float64).reshape(-1, len(values))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{KEY}: is not what diagnose writes ({error}); give a corrected.json") from None
    if values.shape != (len(hypothesis.parameters),) or not _finite([values, draws]):
        raise InputError(
            f"{KEY}.values: must be {len(hypothesis.parameters)} finite numbers; give a corrected.json"
        )
    return hypothesis, values, draws


def _effect_named(name: str) -> Any:
    found = next((effect for effect in catalogue() if effect.name == name), None)
    if found is None:
        raise ValueError(f"effect {name[:40]!r} is not in the catalogue")
    return found


def _finite(arrays: Sequence[FloatArray]) -> bool:
    return all(np.isfinite(values).all() for values in arrays)


def motion_of(records: Sequence[Record]) -> dict[str, object]:
    """The `motion` of a corrected.json: largest command and its rate of change, smallest and largest command,
    and the stroke, in the records' units."""
    return {
        "velocity": max(float(np.abs(r.u).max()) for r in records),
        "acceleration": max(float(np.abs(np.diff(r.u)).max()) * r.sample_rate_hz for r in records),
        "commanded": list(extremes(r.u for r in records)),
        "stroke": [min(float(r.y.min()) for r in records), max(float(r.y.max()) for r in records)],
    }
