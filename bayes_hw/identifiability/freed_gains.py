"""The axis with the gains and thresholds that the paper fixes set free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import C1, C2, C3, HALF_WIDTH
from bayes_hw.model.modal import ModalForm
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, LogNormal

SLOPE = "saturation.gain"
GAIN_POSITIVE = "dead_zone.gain_positive"
GAIN_NEGATIVE = "dead_zone.gain_negative"
HALF_WIDTH_NEGATIVE = "dead_zone.half_width_negative"
ALL_FREED = (SLOPE, GAIN_POSITIVE, GAIN_NEGATIVE, HALF_WIDTH_NEGATIVE)
ASYMMETRIES = (GAIN_NEGATIVE, HALF_WIDTH_NEGATIVE)

LOWER = "saturation.lower"
UPPER = "saturation.upper"
HALF_WIDTH_POSITIVE = "dead_zone.half_width"
GAIN = "gain"

WEAK_LOG_SD = 0.7
"""Prior log sd of every gain and limit set free: a factor of four either way at two standard deviations."""

WEAK_THRESHOLD_LOG_SD = 1.0
"""Prior log sd of either dead-zone threshold: a factor of seven either way at two standard deviations."""

UNMOVED = 1e-30
"""Residue of the pole at z = 1 that stands for a constant: its state is so large that no command moves it."""


class FreedGains(AxisParameters):
    """The parameters of the paper with slopes c1, c2, c3 and the negative threshold set free.

        v = min(max(c1 u, lower), upper),   w = G v,
        y = c2 (w - delta_plus) above delta_plus, c3 (w + delta_minus) below -delta_minus, else 0

    `freed` names those of ALL_FREED that are parameters, after those of AxisParameters; the others keep the
    values of the model. `dead_zone.half_width` is delta_plus, and delta_minus as well unless that is free.
    Limits are in units of v, thresholds in units of w. All priors on these are weak log-normal ones.
    """

    def __init__(
        self,
        model: HammersteinWiener,
        freed: Sequence[str] = ALL_FREED,
        *,
        output_scale: float = 1.0,
        start_positions: FloatArray | None = None,
    ) -> None:
        super().__init__(model, "conditional", output_scale=output_scale, start_positions=start_positions)
        unknown = [name for name in freed if name not in ALL_FREED]
        if unknown:
            raise InputError(
                f"{unknown[0]}: is not a gain that can be freed; choose from {', '.join(ALL_FREED)}"
            )
        self.freed = tuple(name for name in ALL_FREED if name in freed)
        gains = model.normalization
        threshold = self.parameters[self._row[HALF_WIDTH_POSITIVE]].nominal
        units = model.units
        nominal = {
            SLOPE: (gains.c1, "", WEAK_LOG_SD),
            GAIN_POSITIVE: (gains.c2, "", WEAK_LOG_SD),
            GAIN_NEGATIVE: (gains.c3, "", WEAK_LOG_SD),
            HALF_WIDTH_NEGATIVE: (threshold, units.output, WEAK_THRESHOLD_LOG_SD),
        }
        self._n_given = len(self.parameters)
        self.parameters = (
            *(_with_weak_prior(parameter) for parameter in self.parameters),
            *(
                Parameter(name, unit, value, LogNormal(value, log_sd), Logarithm())
                for name, (value, unit, log_sd) in nominal.items()
                if name in self.freed
            ),
        )
        self._row = {parameter.name: row for row, parameter in enumerate(self.parameters)}

    def modal_form(self, values: FloatArray, record: int = 0) -> ModalForm:
        """The modal form of every column of `values` (parameters, walkers), started as record `record`.

        Unequal thresholds are equal ones of their mean width about w = (delta_plus - delta_minus) / 2. A free
        initial state is that of y, before the slope and the threshold of its side.
        """
        gains, ones = self.model.normalization, np.ones(values.shape[1])
        c1 = self._values_of(SLOPE, values, gains.c1 * ones)
        c2 = self._values_of(GAIN_POSITIVE, values, gains.c2 * ones)
        c3 = self._values_of(GAIN_NEGATIVE, values, gains.c3 * ones)
        plus = values[self._row[HALF_WIDTH_POSITIVE]]
        minus = self._values_of(HALF_WIDTH_NEGATIVE, values, plus)
        inner = values[: self._n_given].copy()
        if self.start_positions is not None:
            positive = self.start_positions[record] >= 0
            inner[self._n_structure :] /= c2 if positive else c3
            inner[self._row[HALF_WIDTH_POSITIVE]] = plus if positive else minus
        form = super().modal_form(inner, record)
        static = form.static.copy()
        static[C1], static[C2], static[C3], static[HALF_WIDTH] = c1, c2, c3, (plus + minus) / 2
        form = replace(form, static=static)
        if HALF_WIDTH_NEGATIVE not in self._row:
            return form
        return _with_constant(form, (minus - plus) / 2)

    def embedded(self, values: FloatArray, names: Sequence[str]) -> FloatArray:
        """A vector (parameters,) that takes from `values` what is called so in `names`, and with it the
        negative threshold the positive one; the rest is nominal."""
        known = dict(zip(names, values.tolist(), strict=True))
        if HALF_WIDTH_POSITIVE in known:
            known.setdefault(HALF_WIDTH_NEGATIVE, known[HALF_WIDTH_POSITIVE])
        return np.array([known.get(parameter.name, parameter.nominal) for parameter in self.parameters])

    def _values_of(self, name: str, values: FloatArray, otherwise: FloatArray) -> FloatArray:
        row = self._row.get(name)
        return otherwise if row is None else values[row]


def with_unit_slopes(model: HammersteinWiener) -> HammersteinWiener:
    """The same axis with c1 = c2 = 1: its limits, gain and thresholds in the units of u and y."""
    gains = model.normalization
    limits, zone, linear = model.saturation, model.dead_zone, model.linear
    return replace(
        model,
        saturation=replace(limits, lower=limits.lower / gains.c1, upper=limits.upper / gains.c1, gain=1.0),
        linear=replace(linear, gain=linear.gain * gains.c1 * gains.c2),
        dead_zone=replace(
            zone,
            half_width=zone.half_width * gains.c2,
            gain_positive=1.0,
            gain_negative=gains.c3 / gains.c2,
        ),
    )


def _with_weak_prior(parameter: Parameter) -> Parameter:
    if parameter.name in (LOWER, UPPER, GAIN):
        return replace(parameter, prior=LogNormal(parameter.nominal, WEAK_LOG_SD))
    if parameter.name == HALF_WIDTH_POSITIVE:
        return replace(parameter, prior=LogNormal(parameter.nominal, WEAK_THRESHOLD_LOG_SD))
    return parameter


def _with_constant(form: ModalForm, constant: FloatArray) -> ModalForm:
    """The same cascades with `constant` (walkers,) added to w."""
    pole = np.stack([np.ones(form.walkers), np.full(form.walkers, UNMOVED)])[:, None, :]
    return replace(
        form,
        real=np.concatenate([form.real, pole], axis=1),
        real_state=np.concatenate([form.real_state, constant[None, :] / UNMOVED]),
    )
