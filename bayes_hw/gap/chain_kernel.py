"""The compiled simulator of an axis with effects: command, limiter, drive train, output, sample by sample.

One parameter vector against one record. The linear block is a sum of first-order states in continuous time
(`bayes_hw.gap.drive_train`), stepped exactly for inputs that are constant over a step:

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

TAU = 2 * np.pi

W, MOTOR_ANGLE, MOTOR_SPEED, LOAD_SPEED = range(4)
BY_MOTOR, BY_LOAD = range(2)


@njit(cache=True, nogil=True, error_model="numpy")
def _ramped(rate_state, command, largest, h):  # type: ignore[no-untyped-def]
    """Mean over a step of a command that is followed at `largest` rate, and where it ends."""
    distance = command - rate_state
    needed = abs(distance) / largest
    if needed >= h:
        end = rate_state + np.sign(distance) * largest * h
        return 0.5 * (rate_state + end), end
    return (0.5 * (rate_state + command) * needed + command * (h - needed)) / h, command


@njit(cache=True, nogil=True, error_model="numpy")
def _friction(speed, response, coulomb, static, stribeck_speed, smoothing):  # type: ignore[no-untyped-def]
    """Friction torque of this step: the one that stops the motion, at most the sliding friction.

    `speed` is the speed without friction at the end of the step, `response` what a unit torque adds to it.
    """
    end = speed
    torque = 0.0
    for _ in range(1 if static == 0 else 6):
        sliding = coulomb * (1 + static * np.exp(-((end / stribeck_speed) ** 2)))
        viscous = sliding / smoothing
        slow = speed / (1 + response * viscous)
        sliding_torque = -sliding if speed > 0 else sliding
        torque = -viscous * slow if abs(slow) < smoothing else sliding_torque
        end = 0.5 * (end + speed + response * torque)
    return torque


@njit(cache=True, nogil=True, error_model="numpy")
def _step_factors(poles, h):  # type: ignore[no-untyped-def]
    """exp(s h), and the integral over a step that a constant input adds, for real and complex poles (n,)."""
    turn, hold = np.exp(poles * h), np.empty_like(poles)
    for i in range(len(poles)):
        hold[i] = h if poles[i] == 0 else (turn[i] - 1) / poles[i]
    return turn, hold


@njit(cache=True, nogil=True, error_model="numpy")
def _output(kind, x, real_out, z, pair_out):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(len(x)):
        total += real_out[kind, i] * x[i]
    for i in range(len(z)):
        total += 2 * (pair_out[kind, i].real * z[i].real - pair_out[kind, i].imag * z[i].imag)
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def simulate_chain(u, delay, rate, substeps, command_path, torque_path, direct, s, w, y):  # type: ignore[no-untyped-def]
    """Fill w and y (samples,) for the command u under the settings s, from rest at zero.

    `command_path` holds real poles (n,) in 1/s, their output gains (4, n), the upper poles of pairs (m,) and
    their output gains (4, m); `torque_path` the same with input gains (2, n) and (2, m) by motor and load
    torque after the poles.
    """
    real_poles, real_out, pair_poles, pair_out = command_path
    t_real_poles, t_real_in, t_real_out, t_pair_poles, t_pair_in, t_pair_out = torque_path
    samples, n, m, t_n, t_m = len(u), len(real_poles), len(pair_poles), len(t_real_poles), len(t_pair_poles)
    h = 1.0 / (rate * substeps)
    x, z = np.zeros(n), np.zeros(m, dtype=np.complex128)
    b, c = np.zeros(t_n), np.zeros(t_m, dtype=np.complex128)
    decay, hold = _step_factors(real_poles, h)
    turn, turn_hold = _step_factors(pair_poles, h)
    t_decay, t_hold = _step_factors(t_real_poles, h)
    t_turn, t_turn_hold = _step_factors(t_pair_poles, h)
    motor_response = _output(
        MOTOR_SPEED, t_hold * t_real_in[BY_MOTOR], t_real_out, t_turn_hold * t_pair_in[BY_MOTOR], t_pair_out
    )
    load_response = _output(
        LOAD_SPEED, t_hold * t_real_in[BY_LOAD], t_real_out, t_turn_hold * t_pair_in[BY_LOAD], t_pair_out
    )

    rubbing = s[S.MOTOR_FRICTION] != 0 or s[S.LOAD_FRICTION] != 0
    rippled = s[S.RIPPLE] != 0 or s[S.LOAD_RIPPLE] != 0
    torsional = s[S.CUBIC] != 0 or s[S.GAP] != 0
    torques = rubbing or rippled or torsional

    followed, play, bristle = 0.0, 0.0, 0.0
    whole = int(np.floor(s[S.EXTRA_DELAY]))
    part = s[S.EXTRA_DELAY] - whole
    start_phase = np.sin(s[S.ECCENTRICITY_PHASE])
    for k in range(samples):
        position = _output(W, x, real_out, z, pair_out)
        if torques:
            position += _output(W, b, t_real_out, c, t_pair_out)
        early = k - delay - whole - 1
        late = early + 1
        earlier = u[early] if early >= 0 else 0.0
        later = u[late] if late >= 0 else 0.0
        lower, upper = s[S.LOWER], s[S.UPPER]
        if s[S.LIMIT_DEPTH] != 0:
            swing = 1 + s[S.LIMIT_DEPTH] * np.sin(TAU * position / s[S.LIMIT_PERIOD] + s[S.LIMIT_PHASE])
            lower, upper = lower * swing, upper * swing
        gain = 1.0
        if s[S.GAIN_CHANGE] != 0:
            gain = 1 + s[S.GAIN_CHANGE] * (1 - np.exp(-k / (rate * s[S.GAIN_TIME])))
        output = position
        for j in range(substeps):
            before = min(max(part * substeps - j, 0.0), 1.0)
            limited = before * min(max(earlier, lower), upper) + (1 - before) * min(max(later, lower), upper)
            if s[S.COMMAND_RATE] < np.inf:
                limited, followed = _ramped(followed, limited, s[S.COMMAND_RATE], h)
            v = gain * limited + s[S.BIAS]
            if j == 0:
                output = position + direct * v
            motor_torque, load_torque = 0.0, 0.0
            if rippled or torsional:
                load_angle = _output(W, x, real_out, z, pair_out) + _output(W, b, t_real_out, c, t_pair_out)
                motor_angle = _output(MOTOR_ANGLE, x, real_out, z, pair_out)
                motor_angle += _output(MOTOR_ANGLE, b, t_real_out, c, t_pair_out)
                if s[S.RIPPLE] != 0:
                    motor_torque += s[S.RIPPLE] * np.sin(
                        TAU * motor_angle / s[S.RIPPLE_PERIOD] + s[S.RIPPLE_PHASE]
                    )
                if s[S.LOAD_RIPPLE] != 0:
                    load_torque += s[S.LOAD_RIPPLE] * np.sin(
                        TAU * load_angle / s[S.LOAD_RIPPLE_PERIOD] + s[S.LOAD_RIPPLE_PHASE]
                    )
                if torsional:
                    twist_rate = _output(MOTOR_SPEED, x, real_out, z, pair_out)
                    twist_rate += _output(MOTOR_SPEED, b, t_real_out, c, t_pair_out)
                    twist_rate -= _output(LOAD_SPEED, x, real_out, z, pair_out)
                    twist_rate -= _output(LOAD_SPEED, b, t_real_out, c, t_pair_out)
                    torsion = motor_angle - load_angle + 0.5 * h * twist_rate
                    torque = s[S.CUBIC] * torsion**3
                    if s[S.GAP] != 0:
                        if abs(torsion) < s[S.GAP]:
                            torque -= torsion + s[S.CONTACT_DAMPING] * twist_rate
                        else:
                            torque -= s[S.GAP] if torsion > 0 else -s[S.GAP]
                    motor_torque -= s[S.MOTOR_STIFFNESS] * torque
                    load_torque += s[S.LOAD_STIFFNESS] * torque
            for i in range(n):
                x[i] = decay[i] * x[i] + hold[i] * v
            for i in range(m):
                z[i] = turn[i] * z[i] + turn_hold[i] * v
            if not torques:
                continue
            for i in range(t_n):
                force = t_real_in[BY_MOTOR, i] * motor_torque + t_real_in[BY_LOAD, i] * load_torque
                b[i] = t_decay[i] * b[i] + t_hold[i] * force
            for i in range(t_m):
                push = t_pair_in[BY_MOTOR, i] * motor_torque + t_pair_in[BY_LOAD, i] * load_torque
                c[i] = t_turn[i] * c[i] + t_turn_hold[i] * push
            if s[S.MOTOR_FRICTION] != 0:
                speed = _output(MOTOR_SPEED, x, real_out, z, pair_out)
                speed += _output(MOTOR_SPEED, b, t_real_out, c, t_pair_out)
                coulomb = s[S.MOTOR_FRICTION]
                if s[S.MOTOR_PRESLIDING] > 0:
                    stiffness = s[S.MOTOR_PRESLIDING]
                    slowed = speed - motor_response * stiffness * bristle
                    bristle = (bristle + h * speed) / (
                        1 + stiffness * (h * abs(slowed) / coulomb + h * motor_response)
                    )
                    torque = -stiffness * bristle
                else:
                    torque = _friction(
                        speed,
                        motor_response,
                        coulomb,
                        s[S.MOTOR_STATIC],
                        s[S.MOTOR_STRIBECK_SPEED],
                        s[S.MOTOR_SMOOTHING],
                    )
                for i in range(t_n):
                    b[i] += t_hold[i] * t_real_in[BY_MOTOR, i] * torque
                for i in range(t_m):
                    c[i] += t_turn_hold[i] * t_pair_in[BY_MOTOR, i] * torque
            if s[S.LOAD_FRICTION] != 0:
                speed = _output(LOAD_SPEED, x, real_out, z, pair_out)
                speed += _output(LOAD_SPEED, b, t_real_out, c, t_pair_out)
                torque = _friction(speed, load_response, s[S.LOAD_FRICTION], 0.0, 1.0, s[S.LOAD_SMOOTHING])
                for i in range(t_n):
                    b[i] += t_hold[i] * t_real_in[BY_LOAD, i] * torque
                for i in range(t_m):
                    c[i] += t_turn_hold[i] * t_pair_in[BY_LOAD, i] * torque
        if s[S.PLAY] != 0:
            play = min(max(play, output - s[S.PLAY]), output + s[S.PLAY])
            output = play
        if s[S.ECCENTRICITY] != 0:
            output += s[S.ECCENTRICITY] * (
                np.sin(TAU * output / s[S.ECCENTRICITY_PERIOD] + s[S.ECCENTRICITY_PHASE]) - start_phase
            )
        w[k] = output
        if output > 0:
            output *= s[S.GAIN_RATIO]
        shown = max(output - s[S.DEAD_ZONE], 0.0) + min(output + s[S.DEAD_ZONE], 0.0)
        t = k / rate
        y[k] = shown + s[S.DRIFT_RATE] * t + s[S.DRIFT_SETTLING] * (1 - np.exp(-t / s[S.DRIFT_TIME]))
