"""Compiled match of a drive train's response to a given one, LANES frequencies at once.

The response of the drive train of `bayes_hw.gap.simulate.drive_train` is, with M, L, S the dynamic
stiffnesses of motor, load and structure and C, Cs the couplings 1 + c s, 1 + cs s,

    R = gain (kp s + ki) kl C S / (s D),   D = M H - km kl C^2 S,   H = L S - ks kss Cs^2
    M = s^2 + kp s + ki + km C,   L = s^2 + bl s + kl C + ks Cs,   S = s^2 + kss Cs

Complex numbers are pairs of lanes here: real and imaginary part.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.model.lane_functions import absolute, angle_of, logarithm, where_less
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, load, store

KP, KI, KM, KL, KS, KSS, C, CS, BL, GAIN = range(10)
COUNT = 10

WITHOUT_RESPONSE = 10.0
"""The log ratio where a response is not finite."""


@compiled_inside
def _times(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


@compiled_inside
def _less(a, b):  # type: ignore[no-untyped-def]
    return a[0] - b[0], a[1] - b[1]


@compiled_inside
def _scaled(a, factor):  # type: ignore[no-untyped-def]
    return a[0] * factor, a[1] * factor


@compiled_inside
def _by_s(a, w):  # type: ignore[no-untyped-def]
    """a times i w."""
    return broadcast(0.0) - a[1] * w, a[0] * w


@compiled_inside
def _inverse(a):  # type: ignore[no-untyped-def]
    """1 / a without the care that very large and very small numbers take."""
    over = broadcast(1.0) / (a[0] * a[0] + a[1] * a[1])
    return a[0] * over, broadcast(0.0) - a[1] * over


@compiled_inside
def _keep(slopes, row, groups, slope, known, counted):  # type: ignore[no-untyped-def]
    """Store the parts of a slope in `row` and that `groups` after, zero where nothing is `known` or it is not
    `counted`."""
    kept = where_less(known, broadcast(np.inf), slope[0], broadcast(0.0))
    store(slopes, row, kept * counted)
    kept = where_less(known, broadcast(np.inf), slope[1], broadcast(0.0))
    store(slopes, row + groups, kept * counted)


@compiled
def log_ratios(logs, sign, omega, target, counted, ratios, slopes):  # type: ignore[no-untyped-def]
    """Fill `ratios` (2, frequencies) with log(R / target) of the train `logs` (10,) and `slopes` (10, 2,
    frequencies) with its derivatives by the logarithms, real and imaginary parts, all in rows of lanes.

    `omega`, `counted` (frequencies,) and `target` (2, frequencies) likewise; what is not `counted`, zero
    there, is zero. Where a ratio is not finite it is WITHOUT_RESPONSE with no derivative.
    """
    e = np.exp(logs)
    kp, ki, km, kl, ks = (
        broadcast(e[KP]),
        broadcast(e[KI]),
        broadcast(e[KM]),
        broadcast(e[KL]),
        broadcast(e[KS]),
    )
    kss, c, cs, bl = broadcast(e[KSS]), broadcast(e[C]), broadcast(e[CS]), broadcast(e[BL])
    gain = broadcast(sign * e[GAIN])
    zero, one, two = broadcast(0.0), broadcast(1.0), broadcast(2.0)
    groups = len(omega)
    for group in range(groups):
        w, seen = load(omega, group), load(counted, group)
        square = w * w
        coupling, structural, loop = (one, c * w), (one, cs * w), (ki, kp * w)
        motor = ki + km - square, kp * w + km * c * w
        of_load = kl + ks - square, bl * w + kl * c * w + ks * cs * w
        structure = kss - square, kss * cs * w
        hung = _less(_times(of_load, structure), _scaled(_times(structural, structural), ks * kss))
        coupled = _scaled(_times(coupling, coupling), km * kl)
        inverse = _inverse(_less(_times(motor, hung), _times(coupled, structure)))
        asked = _by_s((load(target, group), load(target, groups + group)), w)
        ratio = _times(_times(_times(loop, coupling), _times(structure, inverse)), _inverse(asked))
        ratio = _scaled(ratio, gain * kl)
        size = broadcast(0.5) * logarithm(ratio[0] * ratio[0] + ratio[1] * ratio[1])
        turn = angle_of(ratio[0], ratio[1])
        known = absolute(size) + absolute(turn)
        lost = broadcast(WITHOUT_RESPONSE)
        store(ratios, group, where_less(known, broadcast(np.inf), size, lost) * seen)
        store(ratios, groups + group, where_less(known, broadcast(np.inf), turn, zero) * seen)

        over_loop, over_structure, over_coupling = _inverse(loop), _inverse(structure), _inverse(coupling)
        by_load = _times(motor, structure)
        by_structure = _less(_times(motor, of_load), coupled)
        pull = _scaled(_times(motor, structural), ks)
        stiff = _times(coupling, structure)
        followed = _less(over_loop, _times(hung, inverse))
        _keep(slopes, 2 * KP * groups + group, groups, _scaled(_by_s(followed, w), kp), known, seen)
        _keep(slopes, 2 * KI * groups + group, groups, _scaled(followed, ki), known, seen)
        slope = _times(_times(coupling, _less(_scaled(stiff, kl), hung)), inverse)
        _keep(slopes, 2 * KM * groups + group, groups, _scaled(slope, km), known, seen)
        slope = _times(_times(coupling, _less(_scaled(stiff, km), by_load)), inverse)
        _keep(slopes, 2 * KL * groups + group, groups, (one + kl * slope[0], kl * slope[1]), known, seen)
        slope = _times(_times(structural, _less(_scaled(pull, kss), _scaled(by_load, ks))), inverse)
        _keep(slopes, 2 * KS * groups + group, groups, slope, known, seen)
        slope = _times(structural, _less(over_structure, _times(_less(by_structure, pull), inverse)))
        _keep(slopes, 2 * KSS * groups + group, groups, _scaled(slope, kss), known, seen)
        both = _scaled(stiff, two * km * kl)
        both = both[0] - km * hung[0] - kl * by_load[0], both[1] - km * hung[1] - kl * by_load[1]
        slope = _times(both, inverse)
        slope = _by_s((over_coupling[0] + slope[0], over_coupling[1] + slope[1]), w)
        _keep(slopes, 2 * C * groups + group, groups, _scaled(slope, c), known, seen)
        both = _scaled(pull, two * kss)
        both = (
            both[0] - ks * by_load[0] - kss * by_structure[0],
            both[1] - ks * by_load[1] - kss * by_structure[1],
        )
        slope = _times(both, inverse)
        slope = _by_s((kss * over_structure[0] + slope[0], kss * over_structure[1] + slope[1]), w)
        _keep(slopes, 2 * CS * groups + group, groups, _scaled(slope, cs), known, seen)
        slope = _by_s(_times(by_load, inverse), w)
        _keep(slopes, 2 * BL * groups + group, groups, _scaled(slope, zero - bl), known, seen)
        _keep(slopes, 2 * GAIN * groups + group, groups, (one, zero), known, seen)


@compiled_inside
def _product(rows, i, others, j, per, spare):  # type: ignore[no-untyped-def]
    """Sum of the products of `per` rows from i on with as many of `others` from j on; `spare` is one row."""
    lanes = broadcast(0.0)
    for k in range(per):
        lanes = lanes + load(rows, i + k) * load(others, j + k)
    store(spare, 0, lanes)
    total = 0.0
    for k in range(LANES):
        total += spare[0, k]
    return total


@compiled
def solve_positive(matrix, right):  # type: ignore[no-untyped-def]
    """Write the solution (n,) of a positive definite `matrix` (n, n) over `right`, Cholesky's factor over the
    lower half of the matrix; false, and both of no use, where it is not positive definite or not finite."""
    n = len(right)
    for i in range(n):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            if i > j:
                matrix[i, j] = rest / matrix[j, j]
            elif 0 < rest < np.inf:
                matrix[i, i] = np.sqrt(rest)
            else:
                return False
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]
    return True


@compiled(nogil=True)
def matched(logs, usual, usual_sd, misfit, smallest, rounds, steps, largest, omega, target, sign):  # type: ignore[no-untyped-def]
    """`rounds` of Gauss-Newton `steps`, each with the misfit left by the last as the noise of the response.

    `logs` (10,) are the start, `usual` and `usual_sd` (10,) the prior; `omega` (rad/s) and `target`
    (frequencies,); `largest` the largest change of a logarithm in a step, `smallest` the least misfit.
    Returns both.
    """
    logs, n = logs.copy(), len(omega)
    groups = -(-n // LANES)
    w, counted, asked = aligned_rows(groups), aligned_rows(groups), aligned_rows(2 * groups)
    for i in range(groups * LANES):
        row, lane, k = i // LANES, i % LANES, min(i, n - 1)
        w[row, lane], counted[row, lane] = omega[k], 1.0 if i < n else 0.0
        asked[row, lane], asked[groups + row, lane] = target[k].real, target[k].imag
    per = 2 * groups
    ratios, slopes, spare = aligned_rows(per), aligned_rows(COUNT * per), aligned_rows(1)
    precision, step = np.empty((COUNT, COUNT)), np.empty(COUNT)
    for number in range(rounds * steps + 1):
        log_ratios(logs, sign, w, asked, counted, ratios, slopes)
        if number > 0 and number % steps == 0:
            misfit = np.sqrt(_product(ratios, 0, ratios, 0, per, spare) / (2 * n) + smallest**2)
        if number == rounds * steps:
            break
        weight = (1 / (3 * misfit)) ** 2
        for i in range(COUNT):
            step[i] = -weight * _product(slopes, i * per, ratios, 0, per, spare)
            step[i] -= (logs[i] - usual[i]) / usual_sd[i] ** 2
            for j in range(i + 1):
                precision[i, j] = weight * _product(slopes, i * per, slopes, j * per, per, spare)
            precision[i, i] += 1 / usual_sd[i] ** 2
        if not solve_positive(precision, step):
            return logs, np.inf
        for i in range(COUNT):
            logs[i] += min(max(step[i], -largest), largest)
    return logs, misfit
