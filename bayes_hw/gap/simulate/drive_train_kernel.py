"""Compiled mathematics of a drive train: its usual proportions, its torque paths, and a resonator on it.

D, H, M, L, S and the couplings are those of `bayes_hw.gap.simulate.match_kernel`.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.gap.simulate.chain_kernel import MOTOR_ANGLE, MOTOR_SPEED, W
from bayes_hw.gap.simulate.continuous_poles import divided
from bayes_hw.gap.simulate.match_kernel import BL, COUNT, CS, GAIN, KI, KL, KM, KP, KS, KSS, C
from bayes_hw.gap.simulate.path import OUTPUTS, ordered


@compiled
def turning_together(poles, outputs):  # type: ignore[no-untyped-def]
    """`outputs` (4, n) of the states at `poles` (n,), upper ones of pairs, with the motor at the load's speed
    whenever the command has been constant for long.

    The fastest real pole, that of the velocity loop, lies near the zero of the gear's damping. There w shows
    next to nothing of it while the motor's ratio to w is nearly infinite, so that a damping a few per cent
    off would have the motor turn at another speed than the load. Both turn at the residue of the integrator;
    without one, or without such a pole, nothing is changed.
    """
    fastest, integrates, speed = -1, False, 0.0
    for i in range(len(poles)):
        if poles[i] == 0:
            integrates = True
            speed += outputs[W, i].real
        elif poles[i].imag == 0 and (fastest < 0 or abs(poles[i]) > abs(poles[fastest])):
            fastest = i
    turned = outputs.copy()
    if fastest < 0 or not integrates:
        return turned
    for i in range(len(poles)):
        if i != fastest and poles[i] != 0:
            settled = (outputs[MOTOR_SPEED, i] / poles[i]).real
            speed += settled if poles[i].imag == 0 else 2 * settled
    turned[MOTOR_SPEED, fastest] = -poles[fastest] * speed
    turned[MOTOR_ANGLE, fastest] = turned[MOTOR_SPEED, fastest] / poles[fastest]
    return turned


@compiled
def usual_logs(poles, real, gain):  # type: ignore[no-untyped-def]
    """Logs (10,) of a drive with usual proportions to its own poles: an integrator, two more that are `real`
    and the upper ones of two pairs."""
    slow, fast, first, second = 0.0, 0.0, 0j, 0j
    for i in range(len(poles)):
        size = abs(poles[i])
        if real[i] == 1:
            slow, fast = max(slow, min(fast, size)), max(fast, size)
        else:
            first, second = second, poles[i]
    if abs(first) > abs(second):
        first, second = second, first
    low, high = abs(first) ** 2, abs(second) ** 2
    logs = np.empty(COUNT)
    logs[KP], logs[KI], logs[KM], logs[KL] = fast, 0.9 * fast * slow, 0.9 * high, 1.25 * low
    logs[KS], logs[KSS], logs[C] = 0.6 * low, 0.9 * high, -0.6 * first.real / low
    logs[CS], logs[BL], logs[GAIN] = -1.4 * second.real / high, -0.3 * first.real, gain
    for i in range(COUNT):
        logs[i] = np.log(logs[i])
    return logs


@compiled_inside
def _value(polynomial, s):  # type: ignore[no-untyped-def]
    total = 0.0j
    for coefficient in polynomial:
        total = total * s + coefficient
    return total


@compiled_inside
def _slope(polynomial, s):  # type: ignore[no-untyped-def]
    """The derivative of a polynomial at `s`."""
    total, slope = 0.0j, 0.0j
    for coefficient in polynomial:
        slope = slope * s + total
        total = total * s + coefficient
    return slope


@compiled_inside
def _product(one, other):  # type: ignore[no-untyped-def]
    """The product of two polynomials, highest power first."""
    found = np.zeros(len(one) + len(other) - 1)
    for i in range(len(one)):
        for j in range(len(other)):
            found[i + j] += one[i] * other[j]
    return found


@compiled_inside
def _add(total, other, factor):  # type: ignore[no-untyped-def]
    """Add a polynomial of no higher degree, times `factor`, to `total`, highest powers first."""
    first = len(total) - len(other)
    for i in range(len(other)):
        total[first + i] += factor * other[i]


@compiled_inside
def _quadratic(leading, middle, last):  # type: ignore[no-untyped-def]
    found = np.empty(3)
    found[0], found[1], found[2] = leading, middle, last
    return found


@compiled
def companion(polynomial):  # type: ignore[no-untyped-def]
    """The companion matrix (n, n) of a polynomial (n + 1,), highest power first."""
    n = len(polynomial) - 1
    matrix = np.zeros((n, n))
    for i in range(n):
        matrix[0, i] = -polynomial[i + 1] / polynomial[0]
        if i > 0:
            matrix[i, i - 1] = 1.0
    return matrix


@compiled
def upper_ones(real, imaginary):  # type: ignore[no-untyped-def]
    """The complex numbers with these parts (n,) whose imaginary part is not negative."""
    found, count = np.empty(len(real), np.complex128), 0
    for i in range(len(real)):
        if imaginary[i] >= 0:
            found[count] = complex(real[i], imaginary[i])
            count += 1
    return found[:count].copy()


@compiled
def torque_polynomials(logs, own, resisting, on_structure):  # type: ignore[no-untyped-def]
    """D, H, M S and kl C S as polynomials in s, the highest power first.

    A resonator with the polynomial `own` that takes the torque `resisting` / `own` per angle of the load, or
    of the structure, adds that to L, or to S; all four are then times `own`.
    """
    kp, ki, km, kl = np.exp(logs[KP]), np.exp(logs[KI]), np.exp(logs[KM]), np.exp(logs[KL])
    ks, kss, c, cs = np.exp(logs[KS]), np.exp(logs[KSS]), np.exp(logs[C]), np.exp(logs[CS])
    bl = np.exp(logs[BL])
    motor = _quadratic(1.0, kp + km * c, ki + km)
    load = _quadratic(1.0, bl + kl * c + ks * cs, kl + ks)
    structure = _quadratic(1.0, kss * cs, kss)
    hosting = _product(structure, own)
    if on_structure:
        _add(hosting, resisting, 1.0)
    hung = _product(load, hosting)
    if not on_structure:
        _add(hung, _product(structure, resisting), 1.0)
    _add(hung, _product(_quadratic(cs * cs, 2 * cs, 1.0), own), -ks * kss)
    coupling = np.empty(2)
    coupling[0], coupling[1] = c, 1.0
    across = _product(coupling, hosting)
    for i in range(len(across)):
        across[i] *= kl
    whole = _product(motor, hung)
    _add(whole, _product(coupling, across), -km)
    return whole, hung, _product(motor, hosting), across


@compiled
def torque_path(s, whole, hung, stiff, across):  # type: ignore[no-untyped-def]
    """What `Path` holds of the states at the poles `s` (n,) that torques on motor and load drive.

    The other arguments are the polynomials of `torque_polynomials`.
    """
    inputs = np.ones((2, len(s)), dtype=np.complex128)
    outputs = np.empty((OUTPUTS, len(s)), dtype=np.complex128)
    for i in range(len(s)):
        by_motor, steep = _value(across, s[i]), _slope(whole, s[i])
        inputs[1, i] = divided(_value(stiff, s[i]), by_motor)
        outputs[0, i], outputs[1, i] = divided(by_motor, steep), divided(_value(hung, s[i]), steep)
        outputs[2, i], outputs[3, i] = s[i] * outputs[1, i], s[i] * outputs[0, i]
    return ordered(s, inputs, outputs)


@compiled
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


@compiled
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


@compiled
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
