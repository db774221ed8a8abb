"""What the command and an effect's torque do to w: the linear ways through the poles of G."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.input_kernel import limited_commands
from bayes_hw.gap.joint.response.joint_values import DIRECT_POLE, Effect, JointValues
from bayes_hw.gap.joint.response.packed_axis import PackedAxis
from bayes_hw.identify.cascade import Structure


def limited_and_gain(packed: PackedAxis, u: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The delayed command `u` (samples,) behind its limits of size and rate while the axis is at `w`
    (samples,), before its curve; and the factor (samples,) that a drift of the gain puts behind the curve."""
    axis = packed.axis()
    change, warming = axis.inputs[K.CHANGE], axis.inputs[K.WARMING]
    gain = 1 + change * (1 - np.exp(-np.arange(len(u)) / warming))
    return limited_commands(u, w, axis.static, axis.inputs), gain


def through_drive(structure: Structure, values: JointValues, rows: FloatArray) -> FloatArray:
    """w (n, samples) under signals (n, samples) in place of the limited command, its delay left out."""
    c = values.cascade
    found = np.zeros_like(rows, dtype=np.float64)
    if structure.integrator:
        found += lfilter([0.0, c.integrator_residue], [1.0, -1.0], rows, axis=1)
    for pole, residue in c.real.T:
        found += lfilter([0.0, residue], [1.0, -pole], rows, axis=1)
    for a1, a2, b1, b2 in c.sections.T:
        found += lfilter([0.0, b1, b2], [1.0, -a1, a2], rows, axis=1)
    return found


def motor_angle(structure: Structure, values: JointValues, v: FloatArray) -> FloatArray:
    """w (samples,) without what swings, of the limited command v (samples,) without torques."""
    c = values.cascade
    rigid = replace(c, sections=c.sections[:, :0])
    return through_drive(structure, replace(values, cascade=rigid), v[None])[0]


def through_port(values: JointValues, effect: Effect, rows: FloatArray) -> FloatArray:
    """w (n, samples) under torques (n, samples) of `effect`."""
    ports, c = effect.ports, values.cascade
    assert ports is not None
    found = np.zeros_like(rows, dtype=np.float64)
    for pole, weight in zip(c.real[0], ports.real, strict=True):
        found += lfilter([0.0, weight], [1.0, -pole], rows, axis=1)
    for (a1, a2), (c1, c2) in zip(c.sections[:2].T, ports.sections.T, strict=True):
        found += lfilter([0.0, c1, c2], [1.0, -a1, a2], rows, axis=1)
    weight, pole = ports.direct
    return np.asarray(found + lfilter([0.0, weight], [1.0, -pole], rows, axis=1), dtype=np.float64)


def port_columns(values: JointValues, torques: FloatArray) -> FloatArray:
    """w (n, columns, samples) under torques (n, samples), a column for every weight of a port: how a torque
    enters is linear in them."""
    c, direct = values.cascade, DIRECT_POLE
    columns = [lfilter([0.0, 1.0], [1.0, -pole], torques, axis=1) for pole in c.real[0]]
    for a1, a2 in c.sections[:2].T:
        first = lfilter([0.0, 1.0], [1.0, -a1, a2], torques, axis=1)
        columns += [first, np.pad(first[:, :-1], ((0, 0), (1, 0)))]
    columns.append(lfilter([0.0, 1.0], [1.0, -direct], torques, axis=1))
    return np.stack(columns, axis=1)


def drive_response(structure: Structure, values: JointValues, z: ComplexArray) -> ComplexArray:
    """Transfer function of `through_drive` at `z` (frequencies,)."""
    c = values.cascade
    found = np.zeros(len(z), dtype=np.complex128)
    if structure.integrator:
        found += c.integrator_residue / (z - 1)
    for pole, residue in c.real.T:
        found += residue / (z - pole)
    for a1, a2, b1, b2 in c.sections.T:
        found += (b1 * z + b2) / (z * z - a1 * z + a2)
    return found


def port_response(values: JointValues, effect: Effect, z: ComplexArray) -> ComplexArray:
    """Transfer function of `through_port` at `z` (frequencies,)."""
    ports, c = effect.ports, values.cascade
    assert ports is not None
    found = np.asarray(ports.direct[0] / (z - ports.direct[1]), dtype=np.complex128)
    for pole, weight in zip(c.real[0], ports.real, strict=True):
        found += weight / (z - pole)
    for (a1, a2), (c1, c2) in zip(c.sections[:2].T, ports.sections.T, strict=True):
        found += (c1 * z + c2) / (z * z - a1 * z + a2)
    return found
