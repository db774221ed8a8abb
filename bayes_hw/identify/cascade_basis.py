"""The part of a cascade that its output is linear in: residues and initial states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.modal import ModalForm


def linear_basis(
    structure: Structure, poles: CascadeValues, commands: Sequence[FloatArray]
) -> list[FloatArray]:
    """Signals that w = G v is a linear combination of, for given denominators: arrays (columns, samples).

    The columns are the residue of the integrator, of the real poles, then (b1, b2) of every section; with
    `structure.free_start` then the free responses of each record in turn: one p^k for every real pole, and
    the two that start with outputs (1, 0) and (0, 1) for every section.
    """
    order, n_real = structure.order, int(structure.integrator) + structure.real_poles
    real_poles = np.concatenate([np.ones(int(structure.integrator)), poles.real[0]])
    real = np.zeros((2, n_real, order))
    real[0] = real_poles[:, None]
    sections = np.zeros((4, structure.sections, order))
    sections[:2] = poles.sections[:2, :, None]
    for i in range(n_real):
        real[1, i, i] = 1.0
    for i in range(structure.sections):
        sections[2, i, n_real + 2 * i] = 1.0
        sections[3, i, n_real + 2 * i + 1] = 1.0
    static = np.zeros((7, order))
    static[0], static[1], static[2], static[4:6] = -np.inf, np.inf, 1.0, 1.0
    states = np.zeros((n_real, order)), np.zeros((2, structure.sections, order))
    form = ModalForm(static, real, sections, *states)
    blocks = []
    for number, command in enumerate(commands):
        before = float(command[0]) if structure.free_start else 0.0
        block = simulate_batch(form, command, structure.delay_samples, before).w
        if structure.free_start:
            free = np.zeros((len(commands), order, len(command)))
            free[number] = _free_responses(real_poles, poles.sections, len(command))
            block = np.concatenate([block, free.reshape(-1, len(command))])
        blocks.append(block)
    return blocks


def with_linear_solution(structure: Structure, poles: CascadeValues, solution: FloatArray) -> CascadeValues:
    """`poles` with the residues (and initial states) that multiply the columns of `linear_basis`."""
    order, n_integrator = structure.order, int(structure.integrator)
    n_real = n_integrator + structure.real_poles
    numerator = solution[n_real:order].reshape(-1, 2).T
    values = replace(
        poles,
        integrator_residue=float(solution[0]) if n_integrator else 0.0,
        real=np.stack([poles.real[0], solution[n_integrator:n_real]]),
        sections=np.concatenate([poles.sections[:2], numerator]),
    )
    if not structure.free_start:
        return values
    return replace(values, starts=solution[order:].reshape(-1, order).copy())


def _free_responses(real_poles: FloatArray, sections: FloatArray, samples: int) -> FloatArray:
    time = np.arange(samples)
    responses = [pole**time for pole in real_poles]
    for a1, a2 in sections[:2].T:
        impulse = np.zeros((2, samples))
        impulse[0, 0] = impulse[1, 1] = 1.0
        impulse[0, 1] = 1 - a1
        responses.extend(signal.lfilter([1.0], [1.0, -a1, a2], impulse, axis=1))
    return np.array(responses).reshape(-1, samples)
