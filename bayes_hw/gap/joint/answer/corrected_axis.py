"""The posterior that a corrected.json holds, for the commands that take one: its linear part as draws of an
axis, its effects beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.answer.axis_with_effects import (
    AxisWithEffects,
    ExpectedInformation,
    as_drawn,
    commanded_in,
    posterior_of_draws,
    said_in,
)
from bayes_hw.gap.joint.answer.corrected_model import joint_response_of, section_pole
from bayes_hw.gap.joint.response.effect_loop import EffectLoop
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import Mode
from bayes_hw.record import Record

CORRECTED, SAMPLED = "corrected.json", "posterior.nc"


@dataclass(frozen=True, eq=False)
class CorrectedAxis(AxisWithEffects):
    """A posterior of the linear part with limits and dead zone; `centre` (size,) is the estimate of the
    response's coordinates, `coordinates` (draws, size) their draws."""

    response: JointResponse
    coordinates: FloatArray
    centre: FloatArray

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
                rows.append(as_drawn(drawn))
        if not rows:
            raise InputError(f"{CORRECTED}: none of its draws has the poles of its model; diagnose again")
        posterior = posterior_of_draws(
            axis, model.noise_sigma, np.array(rows), as_drawn(axis), commanded_in(data)
        )
        largest = max(abs(nominal.saturation.lower), nominal.saturation.upper)
        said = said_in(data, largest, response.scale.travel)
        return cls(posterior, *said, response, np.array(kept), centre)

    @property
    def simulated(self) -> bool:
        return bool(self.response.template)

    def loop_of(self, values: FloatArray) -> EffectLoop:
        return EffectLoop.of(self.response, self.coordinates[self._places(values)])

    def nominal_loop(self) -> EffectLoop:
        return EffectLoop.of(self.response, self.centre[None, :])

    def expected_information(self) -> ExpectedInformation:
        first = self.response.size - sum(self.response.effect_sizes)
        sigma = float(self.posterior.point_estimate[-1])
        return ExpectedInformation(self.coordinates, self.centre, first, sigma, self._angles, self._tangents)

    def _angles(self, u: FloatArray, count: int) -> FloatArray:
        response, at_rest = self.response, self._at_rest(u)
        return np.array(
            [response.simulate(response.values(x), u, at_rest).y for x in self.coordinates[:count]]
        )

    def _tangents(self, u: FloatArray) -> FloatArray:
        """Derivatives (size, samples) of the angle by the coordinates at the estimate."""
        rate, units = self.response.scale.rate_hz, self.posterior.axis.model.units
        record = Record(
            "trial", np.arange(len(u)) / rate, u, np.zeros(len(u)), rate, units, known=self._at_rest(u)
        )
        trial = replace(self.response, records=[record], weights=None)
        ((rows, *_),) = trial.linearise(self.centre, 0)
        return rows[:-1]

    def _at_rest(self, u: FloatArray) -> dict[str, FloatArray]:
        """Known inputs that do not change."""
        return {e.form.column: np.zeros(len(u)) for e in self.response.template if e.form.is_known_input}


def _sections_of(values: JointValues, model: HammersteinWiener) -> list[int]:
    """Which sections are the model's dominant modes."""
    rate, found = model.sample_rate_hz, []
    for mode in model.dominant_modes:
        distance = [
            abs(Mode.from_pole(pole, rate).frequency_hz - mode.frequency_hz) if pole.imag > 0 else np.inf
            for pole in (section_pole(a1, a2) for a1, a2 in values.cascade.sections[:2].T)
        ]
        found.append(int(np.argmin(distance)))
    return found


def _model_of(
    model: HammersteinWiener, response: JointResponse, values: JointValues, dominant: list[int]
) -> HammersteinWiener:
    cascade, rate = values.cascade, model.sample_rate_hz
    lower = cascade.lower if np.isfinite(cascade.lower) else model.saturation.lower
    upper = cascade.upper if np.isfinite(cascade.upper) else model.saturation.upper
    modes = tuple(Mode.from_pole(section_pole(*cascade.sections[:2, i]), rate) for i in dominant)
    return replace(
        model,
        saturation=replace(model.saturation, lower=lower, upper=upper),
        dead_zone=replace(model.dead_zone, half_width=cascade.half_width),
        linear=linear_block(response.structure, cascade),
        dominant_modes=modes,
    )
