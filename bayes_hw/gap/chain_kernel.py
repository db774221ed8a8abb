"""The compiled simulator of axes with effects: command, limiter, drive train, output, sample by sample.

Every lane is one axis under one command; a group of LANES of them advances together (`bayes_hw.model.lanes`).
The linear block is a sum of first-order states in continuous time (`bayes_hw.gap.drive_train`), stepped
exactly for inputs that are constant over a step:

    c(t)     = command delayed by EXTRA_DELAY, clipped to limits(w), followed at COMMAND_RATE at most
    v        = gain(t) c + BIAS
    x_i'     = s_i x_i + v                                          the states of G
    b_j'     = p_j b_j + m_j torque_motor + l_j torque_load         those of the drive train
    w        = sum_i r_i x_i + sum_j q_j b_j,   motor angle, motor speed and load speed likewise
    w*       = play(w) + eccentricity(w), times GAIN_RATIO where positive
    y        = dead zone of w* + drift(t)

with the torques of friction, ripple, stiffening and gap as functions of the motion. Friction is implicit
within a step, so that sticking is exact (time stepping of Moreau, doi 10.1007/978-3-7091-2624-0_1).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.gap import settings as S  # noqa: N812
from bayes_hw.gap.friction_kernel import STATIC_ROUNDS, bent_bristle, sliding_torque
from bayes_hw.model.lane_functions import absolute, exponential, sine, where_less
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, gather, load, maximum, minimum, store

TAU = 2 * np.pi

W, MOTOR_ANGLE, MOTOR_SPEED, LOAD_SPEED = range(4)
BY_MOTOR, BY_LOAD = range(2)


@njit(cache=True, inline="always")
def _clipped(x, lower, upper):  # type: ignore[no-untyped-def]
    return minimum(maximum(x, lower), upper)


@njit(cache=True, inline="always")
def _ramped(command, followed, largest, step):  # type: ignore[no-untyped-def]
    """Mean over a step of a command followed at no more than `largest` a second, and where it ends."""
    zero, half = broadcast(0.0), broadcast(0.5)
    distance = command - followed
    needed = absolute(distance) / largest
    reach = where_less(distance, zero, zero - largest, largest) * step
    mean = (half * (followed + command) * needed + command * (step - needed)) / step
    end = where_less(needed, step, command, followed + reach)
    return where_less(needed, step, mean, followed + half * reach), end


@njit(cache=True, inline="always")
def _wave(s, first, second, angle):  # type: ignore[no-untyped-def]
    """A sine of the angle, with its second harmonic where `second` is true, and a constant."""
    turns = broadcast(TAU) * angle / load(s, first + 1)
    value = load(s, first) * sine(turns + load(s, first + 2)) + load(s, first + 5)
    if second:
        value = value + load(s, first + 3) * sine(turns + turns + load(s, first + 4))
    return value


@njit(cache=True, inline="always")
def _reading_wave(s, first, second, angle):  # type: ignore[no-untyped-def]
    """A sine of the angle, with its second harmonic where `second` is true, zero at the angle zero."""
    turns = broadcast(TAU) * angle / load(s, first + 1)
    phase = load(s, first + 2)
    value = load(s, first) * (sine(turns + phase) - sine(phase))
    if second:
        phase = load(s, first + 4)
        value = value + load(s, first + 3) * (sine(turns + turns + phase) - sine(phase))
    return value


@njit(cache=True, inline="always")
def _output(kind, states, x):  # type: ignore[no-untyped-def]
    """One output of all states: rows of x weighted by those of `states` from row `kind` len(x) on."""
    first = kind * len(x)
    total = broadcast(0.0)
    for i in range(len(x)):
        total = total + load(states, first + i) * load(x, i)
    return total


@njit(cache=True, inline="always")
def _stepped(factors, inputs, door, force, real, x):  # type: ignore[no-untyped-def]
    """The states x a step later under `force` at `door`: `real` real ones, then pairs in two rows each."""
    first = door * len(x)
    for i in range(real):
        store(x, i, load(factors, i) * load(x, i) + load(inputs, first + i) * force)
    for i in range(real, len(x), 2):
        cosine, sinus = load(factors, i), load(factors, i + 1)
        one, other = load(x, i), load(x, i + 1)
        store(x, i, cosine * one - sinus * other + load(inputs, first + i) * force)
        store(x, i + 1, sinus * one + cosine * other + load(inputs, first + i + 1) * force)


@njit(cache=True, inline="always")
def _pushed(inputs, door, force, x):  # type: ignore[no-untyped-def]
    """Add to the states x what `force`, held over a step, adds through the gains of `door`."""
    first = door * len(x)
    for i in range(len(x)):
        store(x, i, load(x, i) + load(inputs, first + i) * force)


@njit(cache=True, nogil=True, error_model="numpy")
def filter_lanes(real_count, factors_of, inputs_of, outputs_of, signals, responses):  # type: ignore[no-untyped-def]
    """Fill responses (samples, lanes) with one output of the states (n,) that `signals` drive from rest."""
    samples, groups, n = len(signals), signals.shape[1] // LANES, len(factors_of)
    factors, inputs, outputs, x = aligned_rows(n), aligned_rows(n), aligned_rows(n), aligned_rows(n)
    for i in range(n):
        store(factors, i, broadcast(factors_of[i]))
        store(inputs, i, broadcast(inputs_of[i]))
        store(outputs, i, broadcast(outputs_of[i]))
    for group in range(groups):
        x[:] = 0.0
        for k in range(samples):
            store(responses, k * groups + group, _output(0, outputs, x))
            _stepped(factors, inputs, 0, load(signals, k * groups + group), real_count, x)


@njit(cache=True, nogil=True, error_model="numpy")
def simulate_lanes(  # type: ignore[no-untyped-def]
    u,
    rate,
    substeps,
    active,
    settings,
    direct,
    real_count,
    factors_of,
    inputs_of,
    outputs_of,
    torque_real_count,
    torque_factors_of,
    torque_inputs_of,
    torque_outputs_of,
    known_positions,
    known_share,
    w_out,
    y_out,
):
    """Fill y_out (samples, lanes), and w_out if it has rows, from rest at zero; lanes are whole groups.

    `u` (samples, lanes) is the command, delayed by the model's and the whole samples of EXTRA_DELAY;
    `settings` (COUNT, lanes), of EXTRA_DELAY the part of a sample left; `active` (COUNT,) is true where they
    matter in all lanes, false where in none; `direct` (1, lanes). `factors_of` (n, lanes) holds exp(s h),
    real and imaginary parts of pairs as
    two rows, `inputs_of` (1, n, lanes) or by torque (2, n, lanes) what a unit input adds in a step,
    `outputs_of` (4, n, lanes) the gains to w, motor angle, motor speed and load speed. Where
    `known_positions` (samples, lanes) has rows, ripple is taken `known_share` of the way from the simulated w
    to them.
    """
    samples, groups = len(u), settings.shape[1] // LANES
    n, t_n = len(factors_of), len(torque_factors_of)
    h = 1.0 / (rate * substeps)
    s, ds = aligned_rows(S.COUNT), aligned_rows(1)
    factors, inputs, outputs = aligned_rows(n), aligned_rows(n), aligned_rows(4 * n)
    t_factors, t_inputs, t_outputs = aligned_rows(t_n), aligned_rows(2 * t_n), aligned_rows(4 * t_n)
    x, b, start = aligned_rows(n), aligned_rows(t_n), aligned_rows(t_n)
    zero, one, step, tau = broadcast(0.0), broadcast(1.0), broadcast(h), broadcast(TAU)

    rubbing, load_rubbing = active[S.MOTOR_FRICTION], active[S.LOAD_FRICTION]
    rippled, load_rippled, mesh = active[S.RIPPLE], active[S.LOAD_RIPPLE], active[S.MESH_RIPPLE]
    torsional = active[S.CUBIC] or active[S.GAP]
    by_motion = rippled or load_rippled or mesh or torsional
    torques = rubbing or load_rubbing or by_motion
    static_rounds = STATIC_ROUNDS if active[S.MOTOR_STATIC] else 1
    load_static_rounds = STATIC_ROUNDS if active[S.LOAD_STATIC] else 1

    for group in range(groups):
        gather(settings, group, s)
        gather(direct, group, ds)
        gather(factors_of, group, factors)
        gather(inputs_of, group, inputs)
        gather(outputs_of, group, outputs)
        gather(torque_factors_of, group, t_factors)
        gather(torque_inputs_of, group, t_inputs)
        gather(torque_outputs_of, group, t_outputs)
        motor_response, load_response = zero, zero
        if torques:
            for i in range(t_n):
                store(start, i, load(t_inputs, i))
            motor_response = _output(MOTOR_SPEED, t_outputs, start)
            for i in range(t_n):
                store(start, i, load(t_inputs, t_n + i))
            load_response = _output(LOAD_SPEED, t_outputs, start)
        x[:], b[:] = 0.0, 0.0
        followed, ramped, play, earlier, last_place = zero, zero, zero, zero, zero
        bristle, load_bristle = zero, zero
        per_smoothing, per_load_smoothing = one / load(s, S.MOTOR_SMOOTHING), one / load(s, S.LOAD_SMOOTHING)
        per_stribeck_speed = one / load(s, S.MOTOR_STRIBECK_SPEED)
        per_load_stribeck_speed = one / load(s, S.LOAD_STRIBECK_SPEED)
        part = zero
        if active[S.EXTRA_DELAY]:
            part = load(s, S.EXTRA_DELAY)
        for k in range(samples):
            later = load(u, k * groups + group)
            position = _output(W, outputs, x)
            if torques:
                position = position + _output(W, t_outputs, b)
            aside = zero
            if len(known_positions):
                aside = broadcast(known_share) * (load(known_positions, k * groups + group) - position)
            lower, upper = load(s, S.LOWER), load(s, S.UPPER)
            gain = one
            if active[S.GAIN_CHANGE]:
                age = broadcast(-k / rate) / load(s, S.GAIN_TIME)
                gain = one + load(s, S.GAIN_CHANGE) * (one - exponential(age))
            output = position
            for j in range(substeps):
                if active[S.LIMIT_DEPTH]:
                    place = _output(W, outputs, x)
                    if torques:
                        place = place + _output(W, t_outputs, b)
                    middle = place + broadcast(0.5) * (place - last_place)
                    last_place = place
                    phase = tau * middle / load(s, S.LIMIT_PERIOD) + load(s, S.LIMIT_PHASE)
                    swing = one + load(s, S.LIMIT_DEPTH) * sine(phase)
                    lower, upper = load(s, S.LOWER) * swing, load(s, S.UPPER) * swing
                asked = later
                if active[S.EARLY_RATE]:
                    asked, ramped = _ramped(later, ramped, load(s, S.EARLY_RATE), step)
                limited = _clipped(asked, lower, upper)
                if active[S.EXTRA_DELAY]:
                    before = _clipped(part * broadcast(1.0 * substeps) - broadcast(1.0 * j), zero, one)
                    limited = before * _clipped(earlier, lower, upper) + (one - before) * limited
                if active[S.COMMAND_RATE]:
                    limited, followed = _ramped(limited, followed, load(s, S.COMMAND_RATE), step)
                v = gain * limited + load(s, S.BIAS)
                if j == 0:
                    output = position + load(ds, 0) * v
                motor_torque, load_torque = zero, zero
                if by_motion:
                    motor_angle, motor_speed, load_angle, load_speed = zero, zero, zero, zero
                    if rippled or mesh or torsional:
                        motor_speed = _output(MOTOR_SPEED, outputs, x) + _output(MOTOR_SPEED, t_outputs, b)
                        motor_angle = _output(MOTOR_ANGLE, outputs, x) + _output(MOTOR_ANGLE, t_outputs, b)
                        motor_angle = motor_angle + broadcast(0.5 * h) * motor_speed
                    if load_rippled or torsional:
                        load_speed = _output(LOAD_SPEED, outputs, x) + _output(LOAD_SPEED, t_outputs, b)
                        load_angle = _output(W, outputs, x) + _output(W, t_outputs, b)
                        load_angle = load_angle + broadcast(0.5 * h) * load_speed
                    motor_place, load_place = motor_angle + aside, load_angle + aside
                    if rippled:
                        motor_torque = _wave(s, S.RIPPLE, active[S.RIPPLE_SECOND], motor_place)
                    if load_rippled:
                        load_torque = _wave(s, S.LOAD_RIPPLE, active[S.LOAD_RIPPLE_SECOND], load_place)
                    if mesh:
                        torque = _wave(s, S.MESH_RIPPLE, active[S.MESH_RIPPLE_SECOND], motor_place)
                        load_torque = load_torque + torque
                        ratio = load(s, S.MOTOR_STIFFNESS) / load(s, S.LOAD_STIFFNESS)
                        motor_torque = motor_torque - ratio * torque
                    if torsional:
                        twist_rate = motor_speed - load_speed
                        torsion = motor_angle - load_angle
                        square = torsion * torsion
                        torque = load(s, S.CUBIC) * torsion * square
                        if active[S.SOFTENING]:
                            torque = torque / (one + load(s, S.SOFTENING) * square)
                        if active[S.GAP]:
                            gap = load(s, S.GAP)
                            inside = torsion + load(s, S.CONTACT_DAMPING) * twist_rate
                            beyond = where_less(zero, torsion, gap, zero - gap)
                            torque = torque - where_less(absolute(torsion), gap, inside, beyond)
                        motor_torque = motor_torque - load(s, S.MOTOR_STIFFNESS) * torque
                        load_torque = load_torque + load(s, S.LOAD_STIFFNESS) * torque
                _stepped(factors, inputs, 0, v, real_count, x)
                if torques:
                    _stepped(t_factors, t_inputs, BY_MOTOR, motor_torque, torque_real_count, b)
                    if by_motion:
                        _pushed(t_inputs, BY_LOAD, load_torque, b)
                    if rubbing:
                        speed = _output(MOTOR_SPEED, outputs, x) + _output(MOTOR_SPEED, t_outputs, b)
                        coulomb = load(s, S.MOTOR_FRICTION)
                        if active[S.MOTOR_PRESLIDING]:
                            stiffness = load(s, S.MOTOR_PRESLIDING)
                            bristle = bent_bristle(
                                speed,
                                motor_response,
                                coulomb,
                                load(s, S.MOTOR_STATIC),
                                per_stribeck_speed,
                                active[S.MOTOR_STATIC],
                                stiffness,
                                bristle,
                                step,
                            )
                            torque = zero - stiffness * bristle
                        else:
                            torque = sliding_torque(
                                speed,
                                motor_response,
                                coulomb,
                                load(s, S.MOTOR_STATIC),
                                per_stribeck_speed,
                                per_smoothing,
                                load(s, S.MOTOR_SMOOTHING),
                                static_rounds,
                            )
                        _pushed(t_inputs, BY_MOTOR, torque, b)
                    if load_rubbing:
                        speed = _output(LOAD_SPEED, outputs, x) + _output(LOAD_SPEED, t_outputs, b)
                        coulomb, smoothing = load(s, S.LOAD_FRICTION), load(s, S.LOAD_SMOOTHING)
                        static = load(s, S.LOAD_STATIC)
                        if active[S.LOAD_PRESLIDING]:
                            stiffness = load(s, S.LOAD_PRESLIDING)
                            load_bristle = bent_bristle(
                                speed,
                                load_response,
                                coulomb,
                                static,
                                per_load_stribeck_speed,
                                active[S.LOAD_STATIC],
                                stiffness,
                                load_bristle,
                                step,
                            )
                            torque = zero - stiffness * load_bristle
                        else:
                            torque = sliding_torque(
                                speed,
                                load_response,
                                coulomb,
                                static,
                                per_load_stribeck_speed,
                                per_load_smoothing,
                                smoothing,
                                load_static_rounds,
                            )
                        _pushed(t_inputs, BY_LOAD, torque, b)
            earlier = later
            if active[S.PLAY]:
                half_gap = load(s, S.PLAY)
                play = _clipped(play, output - half_gap, output + half_gap)
                output = play
            if active[S.ECCENTRICITY]:
                output = output + _reading_wave(s, S.ECCENTRICITY, active[S.ECCENTRICITY_SECOND], output)
            if len(w_out):
                store(w_out, k * groups + group, output)
            output = where_less(zero, output, output * load(s, S.GAIN_RATIO), output)
            half_width = load(s, S.DEAD_ZONE)
            shown = maximum(output - half_width, zero) + minimum(output + half_width, zero)
            shown = where_less(zero, shown, shown * load(s, S.SHOWN_RATIO), shown)
            if active[S.READING_ERROR]:
                shown = shown + _reading_wave(s, S.READING_ERROR, active[S.READING_SECOND], output)
            t = broadcast(k / rate)
            if active[S.DRIFT_RATE]:
                shown = shown + load(s, S.DRIFT_RATE) * t
            if active[S.DRIFT_SETTLING]:
                age = (zero - t) / load(s, S.DRIFT_TIME)
                shown = shown + load(s, S.DRIFT_SETTLING) * (one - exponential(age))
            store(y_out, k * groups + group, shown)
