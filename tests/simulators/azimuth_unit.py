"""The axis of `example_axis` as a Python FMU, in steps of a millisecond."""

from __future__ import annotations

from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Azimuth(Fmi2Slave):  # type: ignore[misc]
    """Two inertias, a spring and a velocity loop."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.motor_inertia, self.dish_inertia = 3.0, 10.0
        self.stiffness, self.damping = 4000.0, 6.0
        self.command = self.motor_torque = self.dish_torque = 0.0
        self.angle = self.speed = self.motor_angle = self.motor_speed = 0.0
        self.integral = 0.0
        tuned = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        for name in ("motor_inertia", "dish_inertia", "stiffness", "damping"):
            self.register_variable(Real(name, **tuned))
        for name in ("command", "motor_torque", "dish_torque"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in ("angle", "speed", "motor_angle", "motor_speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:  # noqa: ARG002
        """As many milliseconds as there are in a step."""
        count = max(1, round(step_size / 0.001))
        h = step_size / count
        for _ in range(count):
            error = self.command - self.motor_speed
            gear = self.stiffness * (self.motor_angle - self.angle)
            gear += self.damping * (self.motor_speed - self.speed)
            torque = 120 * error + 500 * self.integral + self.motor_torque - gear
            self.integral += h * error
            self.motor_speed += h * torque / self.motor_inertia
            self.speed += h * (gear + self.dish_torque) / self.dish_inertia
            self.motor_angle += h * self.motor_speed
            self.angle += h * self.speed
        return True
