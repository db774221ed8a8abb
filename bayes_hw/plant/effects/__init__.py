"""The faults of the plant, one file a place in the axis."""

from __future__ import annotations

from collections.abc import Mapping

from bayes_hw.plant.effects.command import CommandBias, GainDrift, RateLimit, SaturationDrift
from bayes_hw.plant.effects.disturbance import Wind
from bayes_hw.plant.effects.drive import Backlash, DryFriction, TorqueRipple
from bayes_hw.plant.effects.effect import Effect, Scales
from bayes_hw.plant.effects.linear import CubicStiffness, TransportDelay, UnmodelledMode
from bayes_hw.plant.effects.off_catalogue import (
    BoucWen,
    CrossAxis,
    CurrentLimit,
    CurvedCommand,
    DroppedCommands,
    InterpolationFault,
    PeriodicDisturbance,
    PositionDependentMode,
    SaturationRecovery,
    StuckBrake,
    WheelSlip,
)
from bayes_hw.plant.effects.sensor import (
    Eccentricity,
    GainAsymmetry,
    Outliers,
    Quantization,
    SensorDrift,
    TimingJitter,
)
from bayes_hw.plant.effects.unseen import (
    BrownOut,
    CoarseCommand,
    CommandDeadBand,
    Congestion,
    DirectionalGain,
    QuadraticDrag,
    TachoFault,
    ToothSkip,
    WarmingOil,
)

__all__ = ["CATALOGUE", "OFF_CATALOGUE", "OFF_CATALOGUES", "UNSEEN", "Effect", "Scales"]

CATALOGUE: tuple[type[Effect], ...] = (
    RateLimit,
    SaturationDrift,
    CommandBias,
    GainDrift,
    TransportDelay,
    UnmodelledMode,
    CubicStiffness,
    DryFriction,
    Backlash,
    TorqueRipple,
    Wind,
    Quantization,
    Eccentricity,
    SensorDrift,
    TimingJitter,
    GainAsymmetry,
    Outliers,
)
"""One class for every label of the diagnosis' catalogue."""

OFF_CATALOGUE: tuple[type[Effect], ...] = (
    PeriodicDisturbance,
    WheelSlip,
    CrossAxis,
    CurrentLimit,
    DroppedCommands,
    StuckBrake,
    BoucWen,
    PositionDependentMode,
    SaturationRecovery,
    InterpolationFault,
    CurvedCommand,
)
"""Faults whose label is `other`."""

UNSEEN: tuple[type[Effect], ...] = (
    BrownOut,
    CoarseCommand,
    CommandDeadBand,
    Congestion,
    DirectionalGain,
    QuadraticDrag,
    TachoFault,
    ToothSkip,
    WarmingOil,
)
"""More of them, which played no part while the diagnosis was made: they measure how it generalises."""

OFF_CATALOGUES: Mapping[str, tuple[type[Effect], ...]] = {"known": OFF_CATALOGUE, "unseen": UNSEEN}
