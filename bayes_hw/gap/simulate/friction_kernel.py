"""Compiled dry friction within one step: sliding, with a falling curve, and on bristles."""

from __future__ import annotations

from bayes_hw.compiled import compiled_inside, pasted
from bayes_hw.model.lane_functions import absolute, exponential, where_less
from bayes_hw.model.lanes import broadcast, maximum

STATIC_ROUNDS = 3
"""Estimates of the speed at which a falling friction and the motion agree, the first without friction."""

SMALLEST_SLOPE = 0.25
"""Below which the slope of Newton's equation is not believed: there the axis can as well slide as stick."""


@pasted
def coulomb_torque(speed, response, coulomb, per_smoothing, smoothing):  # type: ignore[no-untyped-def]
    """Friction torque of this step: the one that stops the motion, at most Coulomb friction.

    `speed` is the speed without friction at the end of the step, `response` what a unit torque adds to it.
    """
    viscous = coulomb * per_smoothing
    slow = speed * (broadcast(1.0) / (broadcast(1.0) + response * viscous))
    return _torque(speed, slow, coulomb, viscous, smoothing)


@pasted
def falling_torque(  # type: ignore[no-untyped-def]
    speed, response, coulomb, static, per_stribeck_speed, per_smoothing, smoothing
):
    """The same where friction falls with speed: the torque and the speed that it leads to agree."""
    zero, one = broadcast(0.0), broadcast(1.0)
    end = speed
    for _ in range(STATIC_ROUNDS - 1):
        sliding = _level(end, coulomb, static, per_stribeck_speed)
        viscous = sliding * per_smoothing
        held = one / (one + response * viscous)
        slow = speed * held
        torque = _torque(speed, slow, sliding, viscous, smoothing)
        fall = broadcast(-2.0) * end * per_stribeck_speed * per_stribeck_speed * (sliding - coulomb)
        slides = where_less(zero, speed, zero - one, one)
        per_level = where_less(absolute(slow), smoothing, zero - slow * held * per_smoothing, slides)
        slope = maximum(one - response * per_level * fall, broadcast(SMALLEST_SLOPE))
        end = end + (speed + response * torque - end) / slope
    sliding = _level(end, coulomb, static, per_stribeck_speed)
    viscous = sliding * per_smoothing
    slow = speed / (one + response * viscous)
    return _torque(speed, slow, sliding, viscous, smoothing)


@pasted
def _torque(speed, slow, sliding, viscous, smoothing):  # type: ignore[no-untyped-def]
    """Viscous at speeds below `smoothing`, where the speed left is `slow`, the `sliding` friction above."""
    zero = broadcast(0.0)
    slides = where_less(zero, speed, zero - sliding, sliding)
    return where_less(absolute(slow), smoothing, zero - viscous * slow, slides)


@pasted
def _level(speed, coulomb, static, per_stribeck_speed):  # type: ignore[no-untyped-def]
    """Sliding friction at a speed: Stribeck's curve."""
    ratio = speed * per_stribeck_speed
    return coulomb * (broadcast(1.0) + static * exponential(broadcast(0.0) - ratio * ratio))


@pasted
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
    held = stiffness * step * (slowed + response * level)
    return level * (bristle + step * speed) / (level + held)


@compiled_inside(forceinline=True)
def friction_torque(  # type: ignore[no-untyped-def]
    speed, response, coulomb, static, per_stribeck_speed, per_smoothing, smoothing, stiffness, bristle, step,
    falling, presliding,
):  # fmt: skip
    """Friction torque of this step, and the deflection of bristles at its end where it is `presliding`."""
    if presliding:
        bristle = bent_bristle(
            speed, response, coulomb, static, per_stribeck_speed, falling, stiffness, bristle, step
        )
        return broadcast(0.0) - stiffness * bristle, bristle
    if falling:
        torque = falling_torque(
            speed, response, coulomb, static, per_stribeck_speed, per_smoothing, smoothing
        )
        return torque, bristle
    return coulomb_torque(speed, response, coulomb, per_smoothing, smoothing), bristle
