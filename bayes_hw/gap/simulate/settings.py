"""The numbered settings of the compiled chain simulator, with the values that leave an axis as it is.

An effect turns its parameters into some of these; the base parameters into the first few. `NEUTRAL` is an
axis without any effect, limits or dead zone.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray

(
    LOWER,
    UPPER,
    DEAD_ZONE,
    EXTRA_DELAY,
    COMMAND_RATE,
    LIMIT_DEPTH,
    LIMIT_PERIOD,
    LIMIT_PHASE,
    BIAS,
    GAIN_CHANGE,
    GAIN_TIME,
    MOTOR_FRICTION,
    MOTOR_STATIC,
    MOTOR_STRIBECK_SPEED,
    MOTOR_SMOOTHING,
    MOTOR_PRESLIDING,
    LOAD_FRICTION,
    LOAD_STATIC,
    LOAD_STRIBECK_SPEED,
    LOAD_SMOOTHING,
    LOAD_PRESLIDING,
    RIPPLE,
    RIPPLE_PERIOD,
    RIPPLE_PHASE,
    RIPPLE_SECOND,
    RIPPLE_SECOND_PHASE,
    RIPPLE_START,
    LOAD_RIPPLE,
    LOAD_RIPPLE_PERIOD,
    LOAD_RIPPLE_PHASE,
    LOAD_RIPPLE_SECOND,
    LOAD_RIPPLE_SECOND_PHASE,
    LOAD_RIPPLE_START,
    MESH_RIPPLE,
    MESH_RIPPLE_PERIOD,
    MESH_RIPPLE_PHASE,
    MESH_RIPPLE_SECOND,
    MESH_RIPPLE_SECOND_PHASE,
    MESH_RIPPLE_START,
    CUBIC,
    SOFTENING,
    GAP,
    CONTACT_DAMPING,
    MOTOR_STIFFNESS,
    LOAD_STIFFNESS,
    PLAY,
    ECCENTRICITY,
    ECCENTRICITY_PERIOD,
    ECCENTRICITY_PHASE,
    ECCENTRICITY_SECOND,
    ECCENTRICITY_SECOND_PHASE,
    GAIN_RATIO,
    SHOWN_RATIO,
    READING_ERROR,
    READING_PERIOD,
    READING_PHASE,
    READING_SECOND,
    READING_SECOND_PHASE,
    DRIFT_RATE,
    DRIFT_SETTLING,
    DRIFT_TIME,
    INPUT_DEAD_LOWER,
    INPUT_DEAD_UPPER,
    LAG,
    VISCOUS,
    VISCOUS_ASYMMETRY,
    MOTOR_ASYMMETRY,
    EARLY_RATE,
) = range(68)

COUNT = 68

"""Waves hold amplitude, period and phase, amplitude and phase of the second harmonic, and, where they are
torques, a constant, in this order."""

NEUTRAL: FloatArray = np.zeros(COUNT)
NEUTRAL[[LOWER, UPPER]] = -np.inf, np.inf
NEUTRAL[[COMMAND_RATE, EARLY_RATE]] = np.inf
NEUTRAL[[GAIN_RATIO, SHOWN_RATIO, READING_PERIOD]] = 1.0
NEUTRAL[
    [
        LIMIT_PERIOD,
        GAIN_TIME,
        MOTOR_STRIBECK_SPEED,
        MOTOR_SMOOTHING,
        LOAD_SMOOTHING,
        LOAD_STRIBECK_SPEED,
        RIPPLE_PERIOD,
        LOAD_RIPPLE_PERIOD,
        MESH_RIPPLE_PERIOD,
    ]
] = 1.0
NEUTRAL[[ECCENTRICITY_PERIOD, DRIFT_TIME]] = 1.0
NEUTRAL.setflags(write=False)

TORQUES = (MOTOR_FRICTION, LOAD_FRICTION, RIPPLE, LOAD_RIPPLE, MESH_RIPPLE, CUBIC, GAP)
"""Settings that need the drive train's inner motion, and with it short steps."""

WITHIN_SAMPLE = (EXTRA_DELAY, COMMAND_RATE, EARLY_RATE, LIMIT_DEPTH)
"""Settings that change the command between samples."""

SWITCHES = (
    *TORQUES,
    *WITHIN_SAMPLE,
    MOTOR_STATIC,
    MOTOR_PRESLIDING,
    LOAD_STATIC,
    LOAD_PRESLIDING,
    RIPPLE_SECOND,
    LOAD_RIPPLE_SECOND,
    MESH_RIPPLE_SECOND,
    SOFTENING,
    LIMIT_DEPTH,
    GAIN_CHANGE,
    PLAY,
    ECCENTRICITY,
    ECCENTRICITY_SECOND,
    READING_SECOND,
    DRIFT_RATE,
    DRIFT_SETTLING,
)
"""Settings that leave out a part of the simulation where they are neutral."""

IS_SWITCH: BoolArray = np.isin(np.arange(COUNT), SWITCHES)
IS_SWITCH.setflags(write=False)

COMMAND_SIDE = frozenset(
    {
        LOWER,
        UPPER,
        EXTRA_DELAY,
        COMMAND_RATE,
        BIAS,
        GAIN_CHANGE,
        GAIN_TIME,
        INPUT_DEAD_LOWER,
        INPUT_DEAD_UPPER,
        LAG,
    }
)
OUTPUT_SIDE = frozenset(
    {
        PLAY,
        ECCENTRICITY,
        ECCENTRICITY_PERIOD,
        ECCENTRICITY_PHASE,
        GAIN_RATIO,
        DEAD_ZONE,
        DRIFT_RATE,
        DRIFT_SETTLING,
        DRIFT_TIME,
    }
)
FORCE_SIDE = frozenset(
    {
        MOTOR_FRICTION,
        MOTOR_STATIC,
        MOTOR_STRIBECK_SPEED,
        MOTOR_SMOOTHING,
        MOTOR_ASYMMETRY,
        VISCOUS,
        VISCOUS_ASYMMETRY,
        RIPPLE,
        RIPPLE_PERIOD,
        RIPPLE_PHASE,
        RIPPLE_START,
    }
)
"""Settings by where they enter a simulator of any kind: before it, behind it, or as a force within it.

The input's dead zone, the lag and friction that depends on the direction or grows with speed exist for those
simulators alone: a Hammerstein-Wiener axis has a dead zone and a velocity loop of its own.
"""
