"""The labels of the built-in catalogue and the blocks of the axis that they stand in."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, TypeAlias

Block: TypeAlias = Literal["input", "linear", "drive", "disturbance", "sensor"]

BLOCKS: tuple[Block, ...] = ("input", "linear", "drive", "disturbance", "sensor")

LABEL_BLOCKS: Mapping[str, Block] = MappingProxyType(
    {
        "rate_limit": "input",
        "saturation_drift": "input",
        "command_bias": "input",
        "gain_drift": "input",
        "transport_delay": "linear",
        "unmodelled_mode": "linear",
        "cubic_stiffness": "linear",
        "friction": "drive",
        "backlash": "drive",
        "torque_ripple": "drive",
        "wind": "disturbance",
        "encoder_quantization": "sensor",
        "encoder_eccentricity": "sensor",
        "sensor_drift": "sensor",
        "timing_jitter": "sensor",
        "gain_asymmetry": "sensor",
        "outliers": "sensor",
    }
)
"""The 17 labels of the built-in catalogue and their blocks."""
