"""The position loop in the time domain with every nonlinearity: many draws against one reference.

The axis is that of the compiled batch simulator (`bayes_hw.model.kernel`), the controller that of
`bayes_hw.control.controller`; here one feeds the other, sample by sample.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.model.controller_kernel import STATES, LoopSignals, PositionLoop, next_command, start_at_rest


def simulate_loop(
    axis: AxisDraws,
    controller: Controller,
    reference: FloatArray,
    *,
    noise: FloatArray | None = None,
    initial_position: FloatArray | float = 0.0,
) -> LoopSignals:
    """The loop's response to `reference` (samples,) at the axis's rate, output units.

    Where `axis` has an effect, that is in the loop. The axis starts at rest at w = `initial_position`
    ((draws,) or one number), and the controller with the error it then sees, so that nothing moves until the
    reference does. `noise` (draws, samples) is added to what the controller measures.
    """
    samples = len(reference)
    shape = (axis.count, samples)
    numbers = np.array(
        (
            controller.proportional,
            controller.integral * controller.period_s,
            controller.derivative / (controller.derivative_filter_s + controller.period_s),
            controller.derivative_filter_s / (controller.derivative_filter_s + controller.period_s),
            *controller.speed_limit,
            controller.rate_of_change_limit * controller.period_s,
            controller.memory_share,
        )
    )
    sections = np.array(controller.sections, dtype=np.float64).reshape(-1, 5)
    ratio = controller.ratio_to(axis.sample_rate_hz)
    given = np.ascontiguousarray(reference, dtype=np.float64)
    added = np.zeros((0, 0)) if noise is None else np.ascontiguousarray(noise)
    start = np.broadcast_to(np.asarray(initial_position, dtype=np.float64), (axis.count,)).copy()
    delay = ratio * controller.delay_samples
    if axis.effect is not None:
        return axis.effect.simulate(PositionLoop(numbers, sections, ratio, delay, given, added, start))
    signals = LoopSignals(np.empty(shape), np.empty(shape), np.empty(shape))
    _simulate(
        np.ascontiguousarray(axis.real_poles),
        np.ascontiguousarray(axis.real_residues),
        np.ascontiguousarray(axis.pair_poles),
        np.ascontiguousarray(axis.pair_residues),
        axis.direct,
        axis.delay_samples + delay,
        np.stack([axis.lower, axis.upper, axis.half_width]),
        np.array(axis.gains),
        numbers,
        sections,
        ratio,
        given,
        added,
        start,
        *signals,
    )
    return signals


@compiled_inside
def _dead_zone(w, half_width, c2, c3):  # type: ignore[no-untyped-def]
    return c2 * max(w - half_width, 0.0) + c3 * min(w + half_width, 0.0)


@compiled(nogil=True)
def _simulate(  # type: ignore[no-untyped-def]
    real_poles, real_residues, pair_poles, pair_residues, direct, delay, static, gains, numbers, sections,
    ratio, reference, noise, start, u_out, w_out, y_out,
):  # fmt: skip
    c1, c2, c3 = gains
    n_real, n_pairs, n_sections, samples = len(real_poles), len(pair_poles), len(sections), len(reference)
    for draw in range(len(direct)):
        lower, upper, half_width = static[0, draw], static[1, draw], static[2, draw]
        x, s = np.zeros(n_real), np.zeros(n_pairs, dtype=np.complex128)
        line = np.zeros(max(delay, 1))
        held = _dead_zone(start[draw], half_width, c2, c3)
        filters, state = np.zeros((n_sections, 2)), np.zeros(STATES)
        start_at_rest(sections, reference[0] - held, filters, state)
        command = 0.0
        for k in range(samples):
            v = 0.0
            if delay > 0:
                v = min(max(c1 * line[k % delay], lower), upper)
            w = start[draw] + direct[draw] * v
            for i in range(n_real):
                w += real_residues[i, draw] * x[i]
            for m in range(n_pairs):
                w += 2 * (pair_residues[m, draw] * s[m]).real
            y = _dead_zone(w, half_width, c2, c3)
            if k % ratio == 0:
                error = reference[k] - y
                if noise.size > 0:
                    error -= noise[draw, k]
                command = next_command(numbers, sections, error, filters, state)
            if delay > 0:
                line[k % delay] = command
            else:
                v = min(max(c1 * command, lower), upper)
            for i in range(n_real):
                x[i] = real_poles[i, draw] * x[i] + v
            for m in range(n_pairs):
                s[m] = pair_poles[m, draw] * s[m] + v
            u_out[draw, k], w_out[draw, k], y_out[draw, k] = command, w, y
