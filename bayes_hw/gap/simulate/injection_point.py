"""Where a small signal is injected into a simulated axis."""

from __future__ import annotations

from typing import Literal, TypeAlias

InjectionPoint: TypeAlias = Literal["command", "motor_torque", "load_torque", "gear_torque", "output"]
"""v, a torque on the motor, on the load, or on the load with its reaction on the motor, or w."""
