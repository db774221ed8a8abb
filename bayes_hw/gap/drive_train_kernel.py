"""Compiled mathematics of a drive train: its usual proportions, its torque paths, and a resonator on it.

D, H, M, L, S and the couplings are those of `bayes_hw.gap.match_kernel`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.gap.continuous_poles import divided
from bayes_hw.gap.path import OUTPUTS, ordered
from bayes_hw.gap.turning import turning_together


@njit(cache=True, error_model="numpy")
def usual_logs(poles, real, gain):  # type: ignore[no-untyped-def]
    """Logs (10,) of a drive with usual proportions to its own poles: an integrator, two more that are `real`
    and the upper ones of two pairs."""
    magnitudes, pairs = np.sort(np.abs(poles[real == 1])), poles[real == 0]
    slow, fast = magnitudes[1], magnitudes[2]
    first, second = pairs[0], pairs[1]
    if abs(first) > abs(second):
        first, second = second, first
    low, high = abs(first) ** 2, abs(second) ** 2
    stiffnesses = np.array([0.9 * fast * slow, 0.9 * high, 1.25 * low, 0.6 * low, 0.9 * high])
    damping = np.array([-0.6 * first.real / low, -1.4 * second.real / high, -0.3 * first.real])
    return np.log(np.concatenate((np.array([fast]), stiffnesses, damping, np.array([gain]))))


@njit(cache=True, error_model="numpy")
def _value(polynomial, s):  # type: ignore[no-untyped-def]
    total = 0.0j
    for coefficient in polynomial:
        total = total * s + coefficient
    return total


@njit(cache=True, error_model="numpy")
def _sum(one, other):  # type: ignore[no-untyped-def]
    """The sum of two polynomials, highest power first."""
    total = np.zeros(max(len(one), len(other)))
    total[len(total) - len(one) :] += one
    total[len(total) - len(other) :] += other
    return total


@njit(cache=True, error_model="numpy")
def companion(polynomial):  # type: ignore[no-untyped-def]
    """The companion matrix (n, n) of a polynomial (n + 1,), highest power first."""
    n = len(polynomial) - 1
    matrix = np.zeros((n, n))
    for i in range(n):
        matrix[0, i] = -polynomial[i + 1] / polynomial[0]
        if i > 0:
            matrix[i, i - 1] = 1.0
    return matrix


@njit(cache=True, error_model="numpy")
def upper_ones(real, imaginary):  # type: ignore[no-untyped-def]
    """The complex numbers with these parts (n,) whose imaginary part is not negative."""
    found, count = np.empty(len(real), np.complex128), 0
    for i in range(len(real)):
        if imaginary[i] >= 0:
            found[count] = complex(real[i], imaginary[i])
            count += 1
    return found[:count].copy()


@njit(cache=True, error_model="numpy")
def torque_polynomials(logs, own, resisting, on_structure):  # type: ignore[no-untyped-def]
    """D, H, M S and kl C S as polynomials in s, the highest power first.

    A resonator with the polynomial `own` that takes the torque `resisting` / `own` per angle of the load, or
    of the structure, adds that to L, or to S; all four are then times `own`.
    """
    kp, ki, km, kl, ks, kss, c, cs, bl, _ = np.exp(logs)
    coupling, structural = np.array([c, 1.0]), np.array([cs, 1.0])
    motor = np.array([1.0, kp + km * c, ki + km])
    load = np.array([1.0, bl + kl * c + ks * cs, kl + ks])
    structure = np.array([1.0, kss * cs, kss])
    hosting = np.convolve(structure, own)
    if on_structure:
        hosting = _sum(hosting, resisting)
        hung = np.convolve(load, hosting)
    else:
        hung = _sum(np.convolve(load, hosting), np.convolve(structure, resisting))
    hung = _sum(hung, -ks * kss * np.convolve(np.convolve(structural, structural), own))
    across = kl * np.convolve(coupling, hosting)
    whole = _sum(np.convolve(motor, hung), -km * np.convolve(coupling, across))
    return whole, hung, np.convolve(motor, hosting), across


@njit(cache=True, error_model="numpy")
def torque_path(s, whole, hung, stiff, across):  # type: ignore[no-untyped-def]
    """What `Path` holds of the states at the poles `s` (n,) that torques on motor and load drive.

    The other arguments are the polynomials of `torque_polynomials`.
    """
    inputs = np.ones((2, len(s)), dtype=np.complex128)
    outputs = np.empty((OUTPUTS, len(s)), dtype=np.complex128)
    slope = whole[:-1] * np.arange(len(whole) - 1.0, 0.0, -1.0)
    for i in range(len(s)):
        by_motor, steep = _value(across, s[i]), _value(slope, s[i])
        inputs[1, i] = divided(_value(stiff, s[i]), by_motor)
        outputs[0, i], outputs[1, i] = divided(by_motor, steep), divided(_value(hung, s[i]), steep)
        outputs[2, i], outputs[3, i] = s[i] * outputs[1, i], s[i] * outputs[0, i]
    return ordered(s, inputs, outputs)


@njit(cache=True, error_model="numpy")
def _slope(polynomial, s):  # type: ignore[no-untyped-def]
    """The derivative of a polynomial at `s`."""
    total, slope = 0.0j, 0.0j
    for coefficient in polynomial:
        slope = slope * s + total
        total = total * s + coefficient
    return slope


@njit(cache=True, error_model="numpy")
def command_path(s, residues, hung, across):  # type: ignore[no-untyped-def]
    """What `Path` holds of the states at the poles `s` (n,) of G, or of G with a resonator.

    Their `residues` (n,) times the ratios of motor angle, motor speed and load speed to w.
    """
    outputs = np.empty((OUTPUTS, len(s)), dtype=np.complex128)
    for i in range(len(s)):
        angle = residues[i] * divided(_value(hung, s[i]), _value(across, s[i]))
        outputs[0, i], outputs[1, i] = residues[i], angle
        outputs[2, i], outputs[3, i] = s[i] * angle, s[i] * residues[i]
    return ordered(s, np.ones((1, len(s)), dtype=np.complex128), turning_together(s, outputs))


@njit(cache=True, error_model="numpy")
def resonant(poles, residues, real, own, hosted, whole, across, closed, host_across):  # type: ignore[no-untyped-def]
    """Residues of G P at the `poles` of G, at `own` and at `hosted`, P = (D / kl C S) (kl C S' / D').

    G has `residues` and the upper poles of pairs, `real` one where a pole is real. The polynomials are those
    of `torque_polynomials` without the resonator (`whole`, `across`) and with it; `own` are the roots of
    `closed`, `hosted` those of `across` that `host_across` does not share.
    """
    at_g, at_own = len(poles), len(poles) + len(own)
    found = np.empty(at_own + len(hosted), dtype=np.complex128)
    for i in range(len(found)):
        s = poles[i] if i < at_g else (own[i - at_g] if i < at_own else hosted[i - at_own])
        passed = _value(host_across, s) * _value(whole, s)
        over = _value(across, s) if i < at_own else _slope(across, s)
        over *= _slope(closed, s) if at_g <= i < at_own else _value(closed, s)
        entering = 0j
        if i < at_g:
            entering = residues[i]
        else:
            for j in range(at_g):
                entering += divided(residues[j], s - poles[j])
                if real[j] == 0:
                    entering += divided(np.conj(residues[j]), s - np.conj(poles[j]))
        found[i] = divided(entering * passed, over)
    return found


@njit(cache=True, error_model="numpy")
def numerators(poles, residues):  # type: ignore[no-untyped-def]
    """prod (s - pole) (n + 1,) and the numerators (rows, n) of sum residue / (s - pole), highest power first.

    `poles` (n,) and `residues` (rows, n) come in conjugate pairs, so that all of it is real.
    """
    n = len(poles)
    whole = np.zeros(n + 1, np.complex128)
    whole[0] = 1.0
    for i in range(n):
        for j in range(i + 1, 0, -1):
            whole[j] -= poles[i] * whole[j - 1]
    found = np.zeros((len(residues), n))
    for i in range(n):
        quotient = 0j
        for j in range(n):
            quotient = whole[j] + poles[i] * quotient
            for row in range(len(residues)):
                found[row, j] += (residues[row, i] * quotient).real
    return whole.real.copy(), found
