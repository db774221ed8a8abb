"""What rounding adds to readings on average at the angle that is simulated, taken off them.

Noise added after rounding to a step leaves a sawtooth of the angle of that period in the readings, and an
offset of up to half a step. Its harmonics are estimated by generalised least squares together with the base:
errors of the simulated angle blunt the higher ones. What is then left is nearly the noise, so that no slow
error is looked for in what rounding does where the axis rests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, LABEL_PRICE_NATS, AnyFit
from bayes_hw.gap.joint.residuals.beside_fit import best_coefficients
from bayes_hw.gap.joint.residuals.reading_parts import ROUNDING
from bayes_hw.gap.joint.residuals.readings import Readings, read_faults
from bayes_hw.identify.growth.descent import descend, evaluate
from bayes_hw.record import Record

HARMONICS, ROUNDS = 3, 3


def without_rounding(fit: AnyFit, readings: Readings) -> tuple[AnyFit, Readings]:
    """`fit` on readings without what rounding to about `readings.step` adds to them, descended, and the
    faults with the nats of that over an offset alone; both as they were where it explains no more."""
    assert readings.step is not None
    found, step = _taken_off(fit, readings.step, HARMONICS)
    offset, _ = _taken_off(fit, readings.step, 0)
    price = HARMONICS * float(np.log(fit.point.samples)) + LABEL_PRICE_NATS
    nats = found.score - offset.score - price
    if nats <= 0:
        return fit, readings
    named = {**readings.nats, ROUNDING: max(nats, readings.nats[ROUNDING])}
    parameters = {**readings.parameters, f"{ROUNDING}.step": step}
    return found, replace(readings, nats=named, step=step, parameters=parameters, taken_off=True)


def readings_of(records: Sequence[Record], fit: AnyFit) -> AnyFit:
    """The same explanation of the readings as they are in `records`, at its own parameters."""
    whole = zip(records, fit.response.records, strict=True)
    return fit.under(replace(fit.response, records=tuple(replace(one, y=r.y) for r, one in whole)))


def _taken_off(fit: AnyFit, step: float, harmonics: int) -> tuple[AnyFit, float]:
    as_read = fit.response
    for _ in range(ROUNDS):
        columns = _columns(fit, step, harmonics)
        own = best_coefficients(fit, replace(fit, response=as_read), columns, fit.point.whitener)
        if not np.isfinite(own).all():
            break
        bent = (replace(r, y=r.y - own @ c) for r, c in zip(as_read.records, columns, strict=True))
        response = replace(fit.response, records=tuple(bent))
        begun = evaluate(response, fit.point.coordinates)
        fit = replace(fit, response=response, point=descend(response, begun, FULL_STEPS))
        step = read_faults(readings_of(as_read.records, fit)).step or step
    return fit, step


def _columns(fit: AnyFit, step: float, harmonics: int) -> list[FloatArray]:
    """One and the waves (1 + 2 harmonics, samples) of every record at the angles that `fit` simulates."""
    values = fit.values
    found = []
    for record in fit.response.records:
        angle = 2 * np.pi / step * fit.response.simulate(values, record.u, record.known).y
        waves = [f(k * angle) for k in range(1, harmonics + 1) for f in (np.sin, np.cos)]
        found.append(np.stack([np.ones_like(angle), *waves]))
    return found
