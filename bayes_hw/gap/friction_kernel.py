"""Compiled dry friction within one step: sliding, with a falling curve, and on bristles."""

from __future__ import annotations

from numba import njit

from bayes_hw.model.lane_functions import absolute, exponential, where_less
from bayes_hw.model.lanes import broadcast, maximum

STATIC_ROUNDS = 3
"""Newton's steps to the speed at which a falling friction and the motion agree."""

SMALLEST_SLOPE = 0.25
"""Below which the slope of Newton's equation is not believed: there the axis can as well slide as stick."""


@njit(cache=True, error_model="numpy")
def sliding_torque(speed, response, coulomb, static, per_stribeck_speed, per_smoothing, smoothing, rounds):  # type: ignore[no-untyped-def]
    """Friction torque of this step: the one that stops the motion, at most the sliding friction.

    `speed` is the speed without friction at the end of the step, `response` what a unit torque adds to it.
    """
    zero, one = broadcast(0.0), broadcast(1.0)
    end, torque = speed, zero
    for _ in range(rounds):
        sliding = coulomb
        if rounds > 1:
            sliding = _level(end, coulomb, static, per_stribeck_speed)
        viscous = sliding * per_smoothing
        held = one / (one + response * viscous)
        slow = speed * held
        slides = where_less(zero, speed, zero - one, one)
        stopped = absolute(slow)
        torque = where_less(stopped, smoothing, zero - viscous * slow, slides * sliding)
        if rounds > 1:
            fall = broadcast(-2.0) * end * per_stribeck_speed * per_stribeck_speed * (sliding - coulomb)
            per_level = where_less(stopped, smoothing, zero - slow * held * per_smoothing, slides)
            slope = maximum(one - response * per_level * fall, broadcast(SMALLEST_SLOPE))
            end = end + (speed + response * torque - end) / slope
    return torque


@njit(cache=True, inline="always")
def _level(speed, coulomb, static, per_stribeck_speed):  # type: ignore[no-untyped-def]
    """Sliding friction at a speed: Stribeck's curve."""
    ratio = speed * per_stribeck_speed
    return coulomb * (broadcast(1.0) + static * exponential(broadcast(0.0) - ratio * ratio))


@njit(cache=True, inline="always")
def bent_bristle(  # type: ignore[no-untyped-def]
    speed, response, coulomb, static, per_stribeck_speed, falling, stiffness, bristle, step
):
    """Deflection of bristles at the end of a step that would end at `speed` without friction.

    They slide at Coulomb friction, or where `falling` is true at what Stribeck's curve says.
    """
    slowed = absolute(speed - response * stiffness * bristle)
    level = coulomb
    if falling:
        level = _level(slowed, coulomb, static, per_stribeck_speed)
    held = stiffness * step * (slowed / level + response)
    return (bristle + step * speed) / (broadcast(1.0) + held)
