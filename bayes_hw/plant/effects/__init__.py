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
from bayes_hw.plant.effects.second_group import (
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
from bayes_hw.plant.effects.sensor import (
    Eccentricity,
    GainAsymmetry,
    Outliers,
    Quantization,
    SensorDrift,
    TimingJitter,
)
from bayes_hw.plant.effects.unseen import (
    CableWrap,
    CommandPlay,
    Derating,
    HuntingGain,
    LostBallast,
    MainsHum,
    ReadingLead,
    SoftLimiter,
)

__all__ = ["CATALOGUE", "OFF_CATALOGUE", "OFF_CATALOGUES", "SECOND_GROUP", "UNSEEN", "Effect", "Scales"]

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

SECOND_GROUP: tuple[type[Effect], ...] = (
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
"""More of them, met late while the diagnosis was made."""

UNSEEN: tuple[type[Effect], ...] = (
    CableWrap,
    CommandPlay,
    Derating,
    HuntingGain,
    LostBallast,
    MainsHum,
    ReadingLead,
    SoftLimiter,
)
"""Still more, on which the diagnosis was never changed: they measure how it generalises."""

OFF_CATALOGUES: Mapping[str, tuple[type[Effect], ...]] = {
    "known": OFF_CATALOGUE,
    "second": SECOND_GROUP,
    "unseen": UNSEEN,
}
