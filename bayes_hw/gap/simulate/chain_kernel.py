"""The compiled simulator of axes with effects: command, limiter, drive train, output, sample by sample.

Every lane is one axis under one command; a group of LANES of them advances together (`bayes_hw.model.lanes`).
The linear block is a sum of first-order states in continuous time (`bayes_hw.gap.simulate.drive_train`),
stepped exactly for inputs that are constant over a step:

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

from bayes_hw.compiled import compiled, compiled_inside, pasted
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.friction_kernel import friction_torque
from bayes_hw.gap.simulate.state_kernel import later_rows, output_of, pushed, repeated, response_to, stepped
from bayes_hw.model.controller_kernel import STATES, next_command, start_at_rest
from bayes_hw.model.lane_functions import absolute, exponential, sine, where_less
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, gather, load, maximum, minimum, store

TAU = 2 * np.pi

W, MOTOR_ANGLE, MOTOR_SPEED, LOAD_SPEED = range(4)
"""Outputs of the states."""

BY_MOTOR, BY_LOAD = range(2)

MOTOR_PLACE, LOAD_PLACE, TORSION, TWIST_RATE, MOTOR_RATE, LOAD_RATE = range(6)
"""Readings: what torques depend on. Places and torsion are those half a step ahead."""

BY_OUTPUT = np.array([[0.0, 1, 0, 0], [1, 0, 0, 0], [-1, 1, 0, 0], [0, 0, 1, -1], [0, 0, 1, 0], [0, 0, 0, 1]])
BY_OUTPUT_AND_STEP = np.array(
    [[0.0, 0, 0.5, 0], [0, 0, 0, 0.5], [0, 0, 0.5, -0.5], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]
)
"""Shares (readings, outputs) of the outputs in the readings, and those that are times the step."""

READINGS = len(BY_OUTPUT)


@pasted
def _clipped(x, lower, upper):  # type: ignore[no-untyped-def]
    return minimum(maximum(x, lower), upper)


@compiled_inside(forceinline=True)
def _ramped(command, followed, largest, step):  # type: ignore[no-untyped-def]
    """Mean over a step of a command followed at no more than `largest` a second, and where it ends."""
    zero, half = broadcast(0.0), broadcast(0.5)
    distance = command - followed
    needed = absolute(distance) / largest
    reach = where_less(distance, zero, zero - largest, largest) * step
    mean = (half * (followed + command) * needed + command * (step - needed)) / step
    end = where_less(needed, step, command, followed + reach)
    return where_less(needed, step, mean, followed + half * reach), end


@pasted
def _wave(s, first, second, angle):  # type: ignore[no-untyped-def]
    """A sine of the angle, with its second harmonic where `second` is true, and a constant.

    In the place of the period stand the radians per angle.
    """
    turns = angle * load(s, first + 1)
    value = load(s, first) * sine(turns + load(s, first + 2)) + load(s, first + 5)
    if second:
        value = value + load(s, first + 3) * sine(turns + turns + load(s, first + 4))
    return value


@pasted
def _reading_wave(s, first, second, angle):  # type: ignore[no-untyped-def]
    """A sine of the angle, with its second harmonic where `second` is true, zero at the angle zero."""
    turns = broadcast(TAU) * angle / load(s, first + 1)
    phase = load(s, first + 2)
    value = load(s, first) * (sine(turns + phase) - sine(phase))
    if second:
        phase = load(s, first + 4)
        value = value + load(s, first + 3) * (sine(turns + turns + phase) - sine(phase))
    return value


@compiled_inside
def _weigh(reading, h, outputs, n, rows, row):  # type: ignore[no-untyped-def]
    """Write the weights of `reading` for steps of h into `row` of `rows`, given those of all `outputs`."""
    for i in range(n):
        total = broadcast(0.0)
        for kind in range(4):
            share = BY_OUTPUT[reading, kind] + h * BY_OUTPUT_AND_STEP[reading, kind]
            total = total + broadcast(share) * load(outputs, kind * n + i)
        store(rows, row * n + i, total)


@pasted
def _reading(reading, now, per, ahead, by_command, t_ahead, x, v, b):  # type: ignore[no-untyped-def]
    """A reading after `now` steps of the command v since x and none since b, rates a step later."""
    late = reading // MOTOR_RATE
    row = reading * per + now + late
    return output_of(row, ahead, x) + load(by_command, row) * v + output_of(2 * reading + late, t_ahead, b)


@pasted
def _shown(output, play, s, active, k, rate):  # type: ignore[no-untyped-def]
    """The play's position, w*, the same behind the gain's asymmetry, and y, where the axis is at `output` in
    sample `k` and the play was at `play`."""
    zero, one = broadcast(0.0), broadcast(1.0)
    if active[S.PLAY]:
        half_gap = load(s, S.PLAY)
        play = _clipped(play, output - half_gap, output + half_gap)
        output = play
    if active[S.ECCENTRICITY]:
        output = output + _reading_wave(s, S.ECCENTRICITY, active[S.ECCENTRICITY_SECOND], output)
    at = output
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
    return play, at, output, shown


@compiled_inside
def _fed_back(loop, k, group, shown, filters, controls, u):  # type: ignore[no-untyped-def]
    """The controller's sample `k` at what a group's lanes show: its command, written into `u` where it
    arrives."""
    commands, sections = loop.commands, loop.sections
    for i in range(LANES):
        lane = group * LANES + i
        if k == 0:
            start_at_rest(sections, loop.reference[0] - shown[0, lane], filters[i], controls[i])
        if k % loop.ratio == 0:
            error = loop.reference[k] - shown[k, lane]
            if loop.noise.size > 0:
                error -= loop.noise[loop.rows[lane], k]
            commands[k, lane] = next_command(loop.numbers, sections, error, filters[i], controls[i])
        else:
            commands[k, lane] = commands[k - 1, lane]
        arrival = k + loop.delays[lane]
        if arrival < len(u):
            u[arrival, lane] = commands[k, lane]


@compiled(nogil=True)
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
            store(responses, k * groups + group, output_of(0, outputs, x))
            stepped(factors, inputs, 0, load(signals, k * groups + group), real_count, x)


@compiled(nogil=True)
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
    targets,
    gains_of,
    w_out,
    y_out,
    loop,
):
    """Fill y_out (samples, lanes), and w_out if it has rows, from rest at zero; lanes are whole groups.

    `u` (samples, lanes) is the command, delayed by the model's and the whole samples of EXTRA_DELAY;
    `settings` (COUNT, lanes), of EXTRA_DELAY the part of a sample left; `active` (COUNT,) is true where they
    matter in all lanes, false where in none; `direct` (1, lanes). `factors_of` (n, lanes) holds exp(s h),
    real and imaginary parts of pairs as two rows, `inputs_of` (1, n, lanes) or by torque (2, n, lanes) what
    a unit input adds in a step, `outputs_of` (4, n, lanes) the gains to w, motor angle, motor speed and load
    speed. Where `known_positions` (samples, lanes) has rows, ripple is taken `known_share` of the way from
    the simulated w to them. `loop` is a `chain_batch.LoopInLanes`, without samples where no loop is closed.
    """
    samples, groups, closed = len(u), settings.shape[1] // LANES, len(loop.reference) > 0
    n, t_n = len(factors_of), len(torque_factors_of)
    h = 1.0 / (rate * substeps)
    s, ds, start = aligned_rows(S.COUNT), aligned_rows(1), aligned_rows(1)
    factors, inputs, outputs = aligned_rows(n), aligned_rows(n), aligned_rows(4 * n)
    t_factors, t_inputs, t_outputs = aligned_rows(t_n), aligned_rows(2 * t_n), aligned_rows(4 * t_n)
    per = substeps + 1
    ahead, by_command = aligned_rows(READINGS * per * n), aligned_rows(READINGS * per)
    t_ahead, t_by_input = aligned_rows(READINGS * 2 * t_n), aligned_rows(READINGS * 2)
    sample_factors, sample_inputs = aligned_rows(n), aligned_rows(n)
    x, b, gains = aligned_rows(n), aligned_rows(t_n), aligned_rows(t_n)
    for i in range(t_n if len(targets) else 0):
        store(gains, i, broadcast(gains_of[i]))
    ahead_of_command = not direct.any()
    zero, one, step, tau = broadcast(0.0), broadcast(1.0), broadcast(h), broadcast(TAU)

    rubbing, load_rubbing = active[S.MOTOR_FRICTION], active[S.LOAD_FRICTION]
    falling, load_falling = active[S.MOTOR_STATIC], active[S.LOAD_STATIC]
    rippled, load_rippled, mesh = active[S.RIPPLE], active[S.LOAD_RIPPLE], active[S.MESH_RIPPLE]
    torsional = active[S.CUBIC] or active[S.GAP]
    by_load = load_rippled or mesh or torsional or load_rubbing
    torques = rubbing or rippled or by_load or len(targets) > 0
    held = not (
        active[S.EXTRA_DELAY] or active[S.COMMAND_RATE] or active[S.EARLY_RATE] or active[S.LIMIT_DEPTH]
    )

    for group in range(groups):
        gather(settings, group, s)
        gather(direct, group, ds)
        gather(factors_of, group, factors)
        gather(inputs_of, group, inputs)
        gather(outputs_of, group, outputs)
        gather(torque_factors_of, group, t_factors)
        gather(torque_inputs_of, group, t_inputs)
        gather(torque_outputs_of, group, t_outputs)
        for first in (S.RIPPLE, S.LOAD_RIPPLE, S.MESH_RIPPLE):
            store(s, first + 1, tau / load(s, first + 1))
        repeated(factors, inputs, substeps, real_count, sample_factors, sample_inputs)
        for reading in range(READINGS if torques else 0):
            _weigh(reading, h, outputs, n, ahead, reading * per)
            later_rows(ahead, by_command, reading * per, substeps, factors, inputs, real_count, n)
            _weigh(reading, h, t_outputs, t_n, t_ahead, reading * 2)
            later_rows(t_ahead, t_by_input, reading * 2, 1, t_factors, t_inputs, torque_real_count, t_n)
        motor_response = response_to(MOTOR_SPEED, t_outputs, BY_MOTOR, t_inputs, t_n)
        load_response = response_to(LOAD_SPEED, t_outputs, BY_LOAD, t_inputs, t_n)
        motor_by_load = response_to(MOTOR_SPEED, t_outputs, BY_LOAD, t_inputs, t_n)
        load_by_motor = response_to(LOAD_SPEED, t_outputs, BY_MOTOR, t_inputs, t_n)
        coulomb, smoothing, static = (
            load(s, S.MOTOR_FRICTION),
            load(s, S.MOTOR_SMOOTHING),
            load(s, S.MOTOR_STATIC),
        )
        load_coulomb, load_smoothing, load_static = (
            load(s, S.LOAD_FRICTION),
            load(s, S.LOAD_SMOOTHING),
            load(s, S.LOAD_STATIC),
        )
        per_smoothing, per_load_smoothing = one / smoothing, one / load_smoothing
        per_stribeck_speed = one / load(s, S.MOTOR_STRIBECK_SPEED)
        per_load_stribeck_speed = one / load(s, S.LOAD_STRIBECK_SPEED)
        bristles, load_bristles = load(s, S.MOTOR_PRESLIDING), load(s, S.LOAD_PRESLIDING)
        stiffness, load_stiffness = load(s, S.MOTOR_STIFFNESS), load(s, S.LOAD_STIFFNESS)
        stiffness_ratio = zero
        if mesh:
            stiffness_ratio = stiffness / load_stiffness
        x[:], b[:] = 0.0, 0.0
        filters, controls = np.zeros((LANES, len(loop.sections), 2)), np.zeros((LANES, STATES))
        followed, ramped, play, earlier, last_place = zero, zero, zero, zero, zero
        if closed:
            gather(loop.states, group, x)
            gather(loop.start, group, start)
            play, last_place = load(start, 0), load(start, 0)
        bristle, load_bristle, v = zero, zero, zero
        part = zero
        if active[S.EXTRA_DELAY]:
            part = load(s, S.EXTRA_DELAY)
        for k in range(samples):
            position = output_of(W, outputs, x)
            if torques:
                position = position + output_of(W, t_outputs, b)
            if closed and ahead_of_command:
                _, _, _, shown = _shown(position, play, s, active, k, rate)
                store(y_out, k * groups + group, shown)
                _fed_back(loop, k, group, y_out, filters, controls, u)
            later = load(u, k * groups + group)
            aside = zero
            if len(known_positions):
                aside = broadcast(known_share) * (load(known_positions, k * groups + group) - position)
            lower, upper = load(s, S.LOWER), load(s, S.UPPER)
            gain = one
            if active[S.GAIN_CHANGE]:
                age = broadcast(-k / rate) / load(s, S.GAIN_TIME)
                gain = one + load(s, S.GAIN_CHANGE) * (one - exponential(age))
            if held:
                v = gain * _clipped(later, lower, upper) + load(s, S.BIAS)
            output = position
            for j in range(substeps):
                now = j
                if not held:
                    now = 0
                    if active[S.LIMIT_DEPTH]:
                        place = output_of(W, outputs, x)
                        if torques:
                            place = place + output_of(W, t_outputs, b)
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
                if torques:
                    motor_torque, load_torque = zero, zero
                    if rippled or mesh:
                        place = _reading(MOTOR_PLACE, now, per, ahead, by_command, t_ahead, x, v, b) + aside
                        if rippled:
                            motor_torque = _wave(s, S.RIPPLE, active[S.RIPPLE_SECOND], place)
                        if mesh:
                            load_torque = _wave(s, S.MESH_RIPPLE, active[S.MESH_RIPPLE_SECOND], place)
                            motor_torque = motor_torque - stiffness_ratio * load_torque
                    if load_rippled:
                        place = _reading(LOAD_PLACE, now, per, ahead, by_command, t_ahead, x, v, b) + aside
                        wave = _wave(s, S.LOAD_RIPPLE, active[S.LOAD_RIPPLE_SECOND], place)
                        load_torque = load_torque + wave
                    if torsional:
                        torsion = _reading(TORSION, now, per, ahead, by_command, t_ahead, x, v, b)
                        square = torsion * torsion
                        torque = load(s, S.CUBIC) * torsion * square
                        if active[S.SOFTENING]:
                            torque = torque / (one + load(s, S.SOFTENING) * square)
                        if active[S.GAP]:
                            gap = load(s, S.GAP)
                            rate_of_twist = _reading(
                                TWIST_RATE, now, per, ahead, by_command, t_ahead, x, v, b
                            )
                            inside = torsion + load(s, S.CONTACT_DAMPING) * rate_of_twist
                            beyond = where_less(zero, torsion, gap, zero - gap)
                            torque = torque - where_less(absolute(torsion), gap, inside, beyond)
                        motor_torque = motor_torque - stiffness * torque
                        load_torque = load_torque + load_stiffness * torque
                    if rubbing:
                        speed = _reading(MOTOR_RATE, now, per, ahead, by_command, t_ahead, x, v, b)
                        speed = speed + motor_response * motor_torque
                        if by_load:
                            speed = speed + motor_by_load * load_torque
                        torque, bristle = friction_torque(
                            speed, motor_response, coulomb, static, per_stribeck_speed, per_smoothing,
                            smoothing, bristles, bristle, step, falling, active[S.MOTOR_PRESLIDING],
                        )  # fmt: skip
                        motor_torque = motor_torque + torque
                    if load_rubbing:
                        speed = _reading(LOAD_RATE, now, per, ahead, by_command, t_ahead, x, v, b)
                        speed = speed + load_response * load_torque + load_by_motor * motor_torque
                        torque, load_bristle = friction_torque(
                            speed, load_response, load_coulomb, load_static, per_load_stribeck_speed,
                            per_load_smoothing, load_smoothing, load_bristles, load_bristle, step,
                            load_falling, active[S.LOAD_PRESLIDING],
                        )  # fmt: skip
                        load_torque = load_torque + torque
                    stepped(t_factors, t_inputs, BY_MOTOR, motor_torque, torque_real_count, b)
                    if by_load:
                        pushed(t_inputs, BY_LOAD, load_torque, b)
                if not held:
                    stepped(factors, inputs, 0, v, real_count, x)
            if held:
                stepped(sample_factors, sample_inputs, 0, v, real_count, x)
            earlier = later
            play, at, output, shown = _shown(output, play, s, active, k, rate)
            if len(w_out):
                store(w_out, k * groups + group, at)
            store(y_out, k * groups + group, shown)
            if closed and not ahead_of_command:
                _fed_back(loop, k, group, y_out, filters, controls, u)
            if len(targets):
                error = load(targets, k * groups + group) - shown
                error = where_less(absolute(error), broadcast(np.inf), error, zero)
                error = where_less(load(s, S.DEAD_ZONE), absolute(output), error, zero)
                for i in range(t_n):
                    store(b, i, load(b, i) + load(gains, i) * error)
