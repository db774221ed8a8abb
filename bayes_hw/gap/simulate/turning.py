"""Motor and load of a drive train at one speed whenever the command has been constant for long."""

from __future__ import annotations

from numba import njit

from bayes_hw.gap.simulate.chain_kernel import MOTOR_ANGLE, MOTOR_SPEED, W


@njit(cache=True, error_model="numpy")
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
