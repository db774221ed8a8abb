"""Labels, blocks and parameters of effects as they are said in a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from bayes_hw.gap.effects.descriptions import DESCRIPTIONS

BLOCK_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "input": "on the command",
        "linear": "in the linear dynamics",
        "drive": "in the drive train",
        "disturbance": "as a torque from outside",
        "sensor": "in the encoder",
    }
)
"""Where an effect of each block acts."""

PARAMETER_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "period": "period in position",
        "bias": "offset of the command",
        "change": "whole change of the gain",
        "time": "time constant",
        "slope": "slope over position",
        "rate": "rate",
        "amount": "whole drift",
        "step": "step of the reading",
        "size": "size",
        "torque": "torque, as acceleration of what it acts on",
        "displacement": "angle given way under the torque",
        "held": "share of a sample's ramp that is held",
        "presliding": "angle of presliding",
        "smoothing_speed": "speed within which it turns over",
        "static_excess": "excess of static friction",
        "stribeck_speed": "Stribeck speed",
        "half_gap": "half of the gap",
        "log_ratio": "logarithm of the ratio",
        "share_repeated": "share of repeated readings",
        "share_held": "share of readings that show the angle before them",
        "sd": "standard deviation of the instants",
    }
)
"""Parameters of effects, by what follows the label in their names."""

UNSAID = frozenset({"smoothing_speed"})
"""Parameters that a sentence leaves out: they round a corner and are no property that anyone looks up."""


def is_said(name: str) -> bool:
    """Whether a parameter `label.name` of an effect is a property that a reader may look up."""
    return name.partition(".")[2] not in UNSAID


def label_words(label: str) -> str:
    """A label in words, such as "limits that vary with position"."""
    title = DESCRIPTIONS[label].title if label in DESCRIPTIONS else label.replace("_", " ")
    return title[:1].lower() + title[1:]


def parameter_words(name: str) -> str:
    """A parameter `label.name` of an effect in words, without the label."""
    own = name.partition(".")[2] or name
    return PARAMETER_WORDS.get(own, own.replace("_", " "))
