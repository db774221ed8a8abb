"""The posterior that a corrected.json holds, for the commands that take one: its linear part as draws of an
axis, its effects beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.joint.corrected_model import joint_response_of
from bayes_hw.gap.joint.effect_loop import EffectLoop
from bayes_hw.gap.joint.finding import percent, words_of
from bayes_hw.gap.joint.joint_response import JointResponse
from bayes_hw.gap.joint.joint_values import JointValues
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import Mode

CORRECTED, SAMPLED = "corrected.json", "posterior.nc"


@dataclass(frozen=True, eq=False)
class CorrectedAxis:
    """A posterior of the linear part with limits and dead zone, and the effects of every draw in the same
    order; `answer`, `probability` and `next_experiment` as in the verdict; `motion` is what its records did.
    """

    posterior: Posterior
    response: JointResponse
    coordinates: FloatArray
    centre: FloatArray
    answer: tuple[str, ...]
    probability: Mapping[str, float]
    motion: Mapping[str, Any]
    next_experiment: str

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> CorrectedAxis:
        """Of the content of corrected.json. Raises InputError where it is not what diagnose writes."""
        response, centre, draws = joint_response_of(data)
        model = HammersteinWiener.from_dict(data)
        values = response.values(centre)
        dominant = _sections_of(values, model)
        nominal = _model_of(model, response, values, dominant)
        axis = AxisParameters(nominal, "all", output_scale=response.scale.travel)
        kept, rows = [], []
        for coordinates in draws:
            one = _model_of(model, response, response.values(coordinates), dominant)
            drawn = AxisParameters(one, "all", output_scale=response.scale.travel)
            if drawn.names == axis.names:
                kept.append(coordinates)
                rows.append(drawn.nominal)
        if not rows:
            raise InputError(f"{CORRECTED}: none of its draws has the poles of its model; diagnose again")
        white = NoiseEstimate(model.noise_sigma, np.zeros(0), np.zeros(0))
        noise = noise_parameters(white, model.units.output)
        columns = np.column_stack([np.array(rows), np.full(len(rows), model.noise_sigma)])
        answer = tuple(str(label) for label in data.get("answer", ()))
        posterior = Posterior(
            axis,
            noise,
            columns[None, :, None, :],
            np.zeros((1, len(rows), 1)),
            np.append(axis.nominal, model.noise_sigma),
            converged=True,
            problems=(),
            seconds=0.0,
        )
        probability = {str(k): float(v) for k, v in dict(data.get("probability", {})).items()}
        largest = max(abs(nominal.saturation.lower), nominal.saturation.upper)
        travel = response.scale.travel
        plain = {"velocity": largest, "acceleration": largest, "stroke": [-travel / 2, travel / 2]}
        return cls(
            posterior,
            response,
            np.array(kept),
            centre,
            answer,
            probability,
            {**plain, **dict(data.get("motion", {}))},
            str(data.get("next_experiment") or ""),
        )

    @property
    def words(self) -> str:
        """What was missing and is in the model, with how sure that is."""
        said = [
            f"{words_of(label)} ({percent(self.probability[label])} sure)"
            if label in self.probability
            else words_of(label)
            for label in self.answer
        ]
        return " and ".join(said) or "nothing"

    @property
    def simulated(self) -> bool:
        """Whether any effect of the answer changes the response."""
        return bool(self.response.template)

    def loop_of(self, values: FloatArray) -> EffectLoop:
        """The effects of the draws whose parameter vectors are `values` (draws, parameters)."""
        flat = self.posterior.values.reshape(-1, self.posterior.values.shape[-1])
        place = {row.tobytes(): i for i, row in enumerate(flat)}
        chosen = [place[np.ascontiguousarray(row).tobytes()] for row in values]
        return EffectLoop.of(self.response, self.coordinates[chosen])

    def nominal_loop(self) -> EffectLoop:
        """The effects of the model itself."""
        return EffectLoop.of(self.response, self.centre[None, :])


def _sections_of(values: JointValues, model: HammersteinWiener) -> list[int]:
    """Which sections are the model's dominant modes."""
    rate, found = model.sample_rate_hz, []
    for mode in model.dominant_modes:
        distance = [
            abs(Mode.from_pole(pole, rate).frequency_hz - mode.frequency_hz) if pole.imag > 0 else np.inf
            for pole in (_pole(a1, a2) for a1, a2 in values.cascade.sections[:2].T)
        ]
        found.append(int(np.argmin(distance)))
    return found


def _pole(a1: float, a2: float) -> complex:
    return complex(a1 / 2, np.sqrt(max(a2 - a1 * a1 / 4, 0.0)))


def _model_of(
    model: HammersteinWiener, response: JointResponse, values: JointValues, dominant: list[int]
) -> HammersteinWiener:
    cascade, rate = values.cascade, model.sample_rate_hz
    lower = cascade.lower if np.isfinite(cascade.lower) else model.saturation.lower
    upper = cascade.upper if np.isfinite(cascade.upper) else model.saturation.upper
    modes = tuple(Mode.from_pole(_pole(*cascade.sections[:2, i]), rate) for i in dominant)
    return replace(
        model,
        saturation=replace(model.saturation, lower=lower, upper=upper),
        dead_zone=replace(model.dead_zone, half_width=cascade.half_width),
        linear=linear_block(response.structure, cascade),
        dominant_modes=modes,
    )
