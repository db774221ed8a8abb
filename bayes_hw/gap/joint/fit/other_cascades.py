"""Larger and smaller cascades of a fit, with the ports of its effects: what pole or section more or less,
with a sample more of delay, it begins with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.growth import extension


def with_section(fit: JointFit, a1: float, a2: float) -> JointFit:
    """One more section of no weight."""
    values = fit.values
    structure, cascade = extension.with_section(fit.structure, values.cascade, a1, a2)
    effects = _each_port(
        values,
        lambda p: replace(p, sections=_wider(p.sections), signal_sections=_wider(p.signal_sections)),
    )
    return fit.moved(structure, JointValues(cascade, effects), fit.point.whitener)


def with_pole(fit: JointFit, pole: float) -> JointFit:
    """One more real pole of no weight; it joins a single one into a section."""
    values = fit.values
    if fit.structure.real_poles == 1:
        structure, cascade = extension.joined_pole(fit.structure, values.cascade, pole)

        def joined(p: Ports) -> Ports:
            weight, seen = p.real[0], p.signal_real[0]
            return replace(
                p, real=p.real[1:], signal_real=p.signal_real[1:],
                sections=_wider(p.sections, (weight, -weight * pole)),
                signal_sections=_wider(p.signal_sections, (seen, 0.0)),
            )  # fmt: skip

        return fit.moved(structure, JointValues(cascade, _each_port(values, joined)), fit.point.whitener)
    structure, cascade = extension.with_separate_pole(fit.structure, values.cascade, pole)
    effects = _each_port(
        values,
        lambda p: replace(p, real=np.append(p.real, 0.0), signal_real=np.append(p.signal_real, 0.0)),
    )
    return fit.moved(structure, JointValues(cascade, effects), fit.point.whitener)


def smaller_cascades(fit: JointFit) -> list[JointFit]:
    """Without each section and each real pole in turn, the others beginning with what they can do of it."""
    try:
        factor = fit.factor()
    except FloatingPointError:
        factor = None
    structure = fit.structure
    found = [_without_section(fit, number, factor) for number in range(structure.sections)]
    return found + [_without_pole(fit, number, factor) for number in range(structure.real_poles)]


def _without_section(fit: JointFit, number: int, factor: FloatArray | None) -> JointFit:
    values = _with_weights_moved(fit, [], [number], factor)
    structure, cascade = extension.without_section(fit.structure, values.cascade, number)
    effects = _each_port(
        values,
        lambda p: replace(
            p, sections=np.delete(p.sections, number, axis=1),
            signal_sections=np.delete(p.signal_sections, number, axis=1),
        ),
    )  # fmt: skip
    return fit.moved(structure, JointValues(cascade, effects))


def _without_pole(fit: JointFit, number: int, factor: FloatArray | None) -> JointFit:
    values = _with_weights_moved(fit, [number], [], factor)
    structure, cascade = extension.without_real_pole(fit.structure, values.cascade, number)
    effects = _each_port(
        values,
        lambda p: replace(p, real=np.delete(p.real, number), signal_real=np.delete(p.signal_real, number)),
    )
    return fit.moved(structure, JointValues(cascade, effects))


def _with_weights_moved(
    fit: JointFit, poles: Sequence[int], sections: Sequence[int], factor: FloatArray | None
) -> JointValues:
    """The values where the weights of some real poles and sections are zero and all others have, by the
    derivatives' `factor`, moved to where that costs least (Hassibi and Stork 1993, Second order derivatives
    for network pruning: optimal brain surgeon); as they are where derivatives overflow, or that is nearer."""
    s, coordinates = fit.structure, fit.point.coordinates
    # Weights are coordinates as they are: at coordinates that count themselves each is its own place.
    places = fit.response.values(np.arange(len(coordinates), dtype=np.float64))
    out = _weights(places, poles, sections).astype(int)
    left_out = coordinates.copy()
    left_out[out] = 0.0
    if factor is None:
        return fit.response.values(left_out)
    weights = _weights(places, range(s.real_poles), range(s.sections)).astype(int)
    if s.integrator:
        weights = np.append(weights, int(places.cascade.integrator_residue))
    kept, moved = np.setdiff1d(weights, out), left_out.copy()
    moved[kept] += linalg.lstsq(factor[:, kept], factor[:, out] @ coordinates[out], check_finite=False)[0]
    # Behind a law that feeds back, so large a step may be a motion that grows.
    return fit.response.values(min(moved, left_out, key=lambda x: _misfit(fit, x)))


def _misfit(fit: JointFit, coordinates: FloatArray) -> float:
    """Sum of squares of the weighted residuals at other coordinates."""
    found = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for e, told in zip(fit.response.residuals(coordinates), fit.response.told, strict=True):
            measured = e[told]
            found += float(measured @ measured)
    return found if np.isfinite(found) else np.inf


def later(fit: JointFit) -> JointFit:
    """With one more sample of delay."""
    values = fit.values
    structure, cascade = extension.advanced(fit.structure, values.cascade)
    return fit.moved(structure, JointValues(cascade, values.effects))


def _each_port(values: JointValues, change: Callable[[Ports], Ports]) -> tuple[Effect, ...]:
    return tuple(e if e.ports is None else replace(e, ports=change(e.ports)) for e in values.effects)


def _weights(values: JointValues, poles: Sequence[int], sections: Sequence[int]) -> FloatArray:
    """Of these real poles and sections, in G and in every port of the effects."""
    found = [values.cascade.real[1, poles], values.cascade.sections[2:, sections]]
    for effect in values.effects:
        if (ports := effect.ports) is not None:
            found += [ports.real[poles], ports.sections[:, sections]]
            if ports.signal:
                found += [ports.signal_real[poles], ports.signal_sections[:, sections]]
    return np.concatenate([part.ravel() for part in found])


def _wider(weights: FloatArray, column: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    return np.concatenate([weights, np.array(column)[:, None]], axis=1)
