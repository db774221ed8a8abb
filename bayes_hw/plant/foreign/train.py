"""Drive trains of many shapes: hinges about one axis, springs between them, a velocity loop at the motor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.plant.effects.effect import log_uniform

STEPS_PER_SECOND = 200.0
"""Fewest physics steps."""

COM_OFFSET_M = 0.1
MOST_APPENDAGES = 3


@dataclass(frozen=True)
class Spring:
    """Between bodies `one` and `other`; N m/rad and N m s/rad."""

    one: int
    other: int
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Loop:
    """Torque = kp (v - speed) + ki (integral of it) - kd (filtered acceleration) + ff (filtered dv/dt),
    through a current loop of time constant `current_s` (0: none). In N m, rad and s; `kind` names it."""

    kind: str
    kp: float
    ki: float = 0.0
    kd: float = 0.0
    ff: float = 0.0
    filter_s: float = 0.03
    current_s: float = 0.0


@dataclass(frozen=True)
class Train:
    """Bodies with inertias (kg m^2) and bearing damping (N m s/rad), springs, loop; indices of the motor, the
    load, the body that the encoder reads and the gear's spring."""

    inertias: tuple[float, ...]
    bearings: tuple[float, ...]
    springs: tuple[Spring, ...]
    loop: Loop
    motor: int
    load: int
    encoder: int
    gear: int
    dish: int

    @property
    def inertia(self) -> float:
        """Of all bodies together."""
        return sum(self.inertias)

    def with_appendage(self, host: int, inertia: float, hz: float, damping_ratio: float) -> Train:
        """One more body on a spring at `host`; `hz` is that of the body with its host held."""
        spring = sprung(host, len(self.inertias), inertia, hz, damping_ratio)
        return replace(
            self,
            inertias=(*self.inertias, inertia),
            bearings=(*self.bearings, 0.0),
            springs=(*self.springs, spring),
        )

    def mjcf(self, step_s: float) -> str:
        """The model in MuJoCo's own format; the load's centre of mass lies off the axis, which only gravity
        would notice, and there is none."""
        bodies = []
        for i, (inertia, bearing) in enumerate(zip(self.inertias, self.bearings, strict=True)):
            own = inertia - COM_OFFSET_M**2 * 1e-3 if i == self.load else inertia
            at = f"{COM_OFFSET_M} 0 0" if i == self.load else "0 0 0"
            bodies.append(
                f'<body><inertial pos="{at}" mass="1e-3" diaginertia="{own!r} {own!r} {own!r}"/>'
                f'<joint name="j{i}" type="hinge" axis="0 0 1" damping="{bearing!r}" '
                'solimpfriction="0.98 0.995 0.001 0.5 2" solreffriction="0.01 1"/></body>'
            )
        tendons = [
            f'<fixed stiffness="{s.stiffness!r}" damping="{s.damping!r}" springlength="0 0">'
            f'<joint joint="j{s.one}" coef="1"/><joint joint="j{s.other}" coef="-1"/></fixed>'
            for s in self.springs
        ]
        return (
            f'<mujoco><compiler angle="radian"/><option timestep="{step_s!r}" gravity="0 0 0" '
            'integrator="implicitfast"><flag contact="disable"/></option>'
            f"<worldbody>{''.join(bodies)}</worldbody><tendon>{''.join(tendons)}</tendon></mujoco>"
        )


def sprung(host: int, body: int, inertia: float, hz: float, damping_ratio: float) -> Spring:
    """The spring at which `body` of this inertia swings at `hz` with its host held."""
    omega = 2 * np.pi * hz
    return Spring(host, body, float(inertia * omega**2), float(2 * damping_ratio * inertia * omega))


def draw_train(rng: np.random.Generator, highest_hz: float) -> Train:
    """Direct drives, one or two compliances; no to three appendages at load, motor or one another; loops P,
    PI, PID, with feed-forward, or none; encoder at load or motor. `highest_hz` bounds the springs."""
    stages = int(rng.choice([0, 1, 2], p=[0.25, 0.5, 0.25]))
    load = 1.0
    motor = 0.0 if stages == 0 else log_uniform(rng, 0.15, 2.5)
    inertias = [load] if stages == 0 else [motor, load]
    springs = []
    top = highest_hz / 2
    if stages == 1:
        springs = [sprung(0, 1, load, log_uniform(rng, 0.12, 0.5) * top, float(rng.uniform(0.02, 0.08)))]
    elif stages == 2:
        middle = log_uniform(rng, 0.05, 0.4)
        inertias.append(middle)
        springs = [
            sprung(2, 1, load, log_uniform(rng, 0.12, 0.4) * top, float(rng.uniform(0.02, 0.08))),
            sprung(0, 2, middle, log_uniform(rng, 0.4, 0.9) * top, float(rng.uniform(0.03, 0.1))),
        ]
    at_load = 0 if stages == 0 else 1
    train = Train(
        tuple(inertias),
        tuple(log_uniform(rng, 0.005, 0.1) * i for i in inertias),
        tuple(springs),
        _draw_loop(rng, stages),
        0,
        at_load,
        0 if rng.random() < 0.2 else at_load,
        0,
        at_load,
    )
    for number in range(int(rng.integers(1 if stages == 0 else 0, MOST_APPENDAGES + 1))):
        hosts = [at_load, at_load, at_load, 0, len(train.inertias) - 1 if number else at_load]
        host = int(rng.choice(hosts))
        hz = log_uniform(rng, 0.15, 0.8) * top
        inertia = log_uniform(rng, 0.04, 0.5)
        train = train.with_appendage(host, inertia, hz, log_uniform(rng, 0.01, 0.06))
        if number == 0:
            train = replace(train, dish=len(train.inertias) - 1)
    loop, total = train.loop, train.inertia
    scaled = replace(loop, kp=loop.kp * total, ki=loop.ki * total, kd=loop.kd * total, ff=loop.ff * total)
    return replace(train, loop=scaled)


def _draw_loop(rng: np.random.Generator, stages: int) -> Loop:
    """Gains per unit of inertia: the loop's corner lies between 0.4 and 2.5 Hz, without a loop far below."""
    kind = str(rng.choice(["P", "PI", "PID", "PI+FF", "none"], p=[0.15, 0.4, 0.15, 0.2, 0.1]))
    corner = 2 * np.pi * log_uniform(rng, 0.4, 2.5 if stages == 0 else 2.0)
    current = log_uniform(rng, 0.005, 0.02) if rng.random() < 0.4 else 0.0
    if kind == "none":
        return Loop(kind, corner / 5, current_s=current)
    if kind == "P":
        return Loop(kind, corner, current_s=current)
    integral = corner * corner / log_uniform(rng, 3.0, 12.0)
    return Loop(
        kind,
        corner,
        integral,
        kd=float(rng.uniform(0.1, 0.5)) if kind == "PID" else 0.0,
        ff=float(rng.uniform(0.3, 0.9)) if kind == "PI+FF" else 0.0,
        filter_s=log_uniform(rng, 0.03, 0.08),
        current_s=current,
    )
