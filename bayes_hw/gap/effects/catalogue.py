"""Every effect known, those of other packages included, and the labels with their blocks."""

from __future__ import annotations

from importlib.metadata import entry_points

from bayes_hw.errors import InputError
from bayes_hw.gap.effects.drive import (
    DynamicBacklash,
    KinematicBacklash,
    LoadRipple,
    MeshRipple,
    TorqueRipple,
)
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.friction import (
    CoulombFrictionAtLoad,
    CoulombFrictionAtMotor,
    PreslidingFriction,
    StribeckFrictionAtMotor,
)
from bayes_hw.gap.effects.input import (
    CommandBias,
    EarlyRateLimit,
    GainDrift,
    RateLimit,
    SaturationDrift,
    SaturationSlope,
)
from bayes_hw.gap.effects.labels import BLOCKS, LABEL_BLOCKS, Block
from bayes_hw.gap.effects.linear import (
    CubicStiffness,
    ModeOnStructure,
    SofteningStiffness,
    TransportDelay,
    UnmodelledMode,
)
from bayes_hw.gap.effects.sensor import (
    EncoderEccentricity,
    GainAsymmetry,
    LinearSensorDrift,
    ReadingAsymmetry,
    ReadingEccentricity,
    ThermalSensorDrift,
)

ENTRY_POINT_GROUP = "bayes_hw.effects"

BUILT_IN: tuple[type[Effect], ...] = (
    RateLimit,
    EarlyRateLimit,
    SaturationDrift,
    SaturationSlope,
    CommandBias,
    GainDrift,
    TransportDelay,
    UnmodelledMode,
    ModeOnStructure,
    CubicStiffness,
    SofteningStiffness,
    CoulombFrictionAtMotor,
    StribeckFrictionAtMotor,
    PreslidingFriction,
    CoulombFrictionAtLoad,
    KinematicBacklash,
    DynamicBacklash,
    TorqueRipple,
    LoadRipple,
    MeshRipple,
    EncoderEccentricity,
    ReadingEccentricity,
    GainAsymmetry,
    ReadingAsymmetry,
    LinearSensorDrift,
    ThermalSensorDrift,
)


def catalogue(without: frozenset[str] = frozenset()) -> tuple[Effect, ...]:
    """Every effect that changes the response, built in or registered, but those with a label in `without`.

    Other packages register a subclass of `Effect` under the entry point group `bayes_hw.effects`. Raises
    InputError where one cannot be loaded.
    """
    found: list[Effect] = [kind() for kind in BUILT_IN]
    for point in entry_points(group=ENTRY_POINT_GROUP):
        try:
            registered = point.load()()
        except Exception as error:
            raise InputError(f"effect {point.name!r} of {point.value}: cannot be loaded ({error})") from error
        if fault := _fault(registered):
            raise InputError(f"effect {point.name!r} of {point.value}: {fault}")
        found.append(registered)
    return tuple(effect for effect in found if effect.label not in without)


def _fault(registered: object) -> str:
    """What keeps a registered object from being an effect, empty where nothing does: members that its classes
    name and give no value, a block that is none."""
    if not isinstance(registered, Effect):
        return "is no subclass of Effect"
    classes = type(registered).__mro__
    named = dict.fromkeys(name for one in classes for name in vars(one).get("__annotations__", ()))
    if lacking := [name for name in named if not hasattr(registered, name)]:
        return f"gives no {' and no '.join(lacking)}"
    if registered.block not in BLOCKS:
        return f"block {registered.block!r}; use one of {', '.join(BLOCKS)}"
    return ""


def known_labels() -> list[str]:
    """The labels that can be named or left out: those of the formats, then those of other packages."""
    return [*LABEL_BLOCKS, *sorted({effect.label for effect in catalogue()} - set(LABEL_BLOCKS))]


def block_of(label: str, effects: tuple[Effect, ...] = ()) -> Block:
    """The block of a label, of the built-in catalogue or of one of `effects`."""
    if label in LABEL_BLOCKS:
        return LABEL_BLOCKS[label]
    return next(effect.block for effect in effects if effect.label == label)
