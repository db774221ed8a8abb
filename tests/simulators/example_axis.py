"""A motor, a gear and a dish under a velocity loop, in files, and what is declared of them."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.record import Record, Units

MJCF = """<mujoco model="azimuth">
  <compiler angle="radian"/>
  <option timestep="0.002" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body name="rotor">
      <joint name="motor" axis="0 0 1" armature="3" damping="0.5"/>
      <geom type="cylinder" size="0.1 0.05" mass="0.01" contype="0" conaffinity="0"/>
    </body>
    <body name="dish">
      <joint name="azimuth" axis="0 0 1" armature="10" damping="2"/>
      <geom type="cylinder" size="0.5 0.05" mass="0.1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="gear" stiffness="4000" damping="6" springlength="0">
      <joint joint="motor" coef="1"/>
      <joint joint="azimuth" coef="-1"/>
    </fixed>
  </tendon>
  <actuator>
    ACTUATORS
  </actuator>
  <sensor>
    <jointpos name="encoder" joint="azimuth"/>
  </sensor>
</mujoco>
"""
LOOP_INSIDE = """<velocity name="rate" joint="motor" kv="120"/>
    <intvelocity name="hold" joint="motor" kp="500" actrange="-100 100"/>"""
TORQUE_MOTOR = '<motor name="torque" joint="motor"/>'

DECLARED = """name = "azimuth"
[command]
actuators = ["rate", "hold"]
unit = "deg/s"
simulator_unit = "rad/s"
[measured]
joint = "azimuth"
unit = "deg"
simulator_unit = "rad"
[record]
sample_rate_hz = 50.0
[noise]
sigma = 0.002
[[uncertain]]
parameter = "joint/azimuth/armature"
relative_sd = 0.15
[[uncertain]]
parameter = "tendon/gear/stiffness"
relative_sd = 0.15
[forces.motor]
joint = "motor"
[forces.load]
joint = "azimuth"
[forces.compliance]
tendon = "gear"
"""
DECLARED_LOOP = """[loop]
proportional = 120.0
integral = 500.0
speed_of = "motor"
limit = 1000.0
"""

URDF = """<robot name="dish">
  <link name="base">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="dish">
    <inertial><mass value="5"/><inertia ixx="4" iyy="4" izz="8" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="azimuth" type="continuous">
    <parent link="base"/><child link="dish"/><axis xyz="0 0 1"/><dynamics damping="1.5" friction="0"/>
  </joint>
</robot>
"""
URDF_DECLARED = """name = "dish"
[command]
unit = "deg/s"
simulator_unit = "rad/s"
[measured]
joint = "azimuth"
unit = "deg"
simulator_unit = "rad"
[record]
sample_rate_hz = 50.0
[[uncertain]]
parameter = "joint/azimuth/damping"
relative_sd = 0.3
[forces.load]
joint = "azimuth"
[loop]
proportional = 60.0
integral = 100.0
speed_of = "azimuth"
torque_on = "azimuth"
"""


def write_mjcf(folder: Path, actuators: str = LOOP_INSIDE, declared: str = DECLARED) -> Path:
    """The MuJoCo model with its declaration beside it."""
    path = folder / "axis.xml"
    path.write_text(MJCF.replace("ACTUATORS", actuators))
    path.with_suffix(".toml").write_text(declared)
    return path


def needs(*packages: str) -> bool:
    """Whether one of the packages is not installed."""
    return any(importlib.util.find_spec(name) is None for name in packages)


def commands(rng: np.random.Generator, samples: int, rate: float = 50.0) -> FloatArray:
    """Steps, sines and rests (samples,), deg/s, from a second at rest."""
    parts: list[FloatArray] = [np.zeros(round(rate))]
    while sum(map(len, parts)) < samples:
        count = int(rng.integers(round(rate), round(5 * rate)))
        t = np.arange(count) / rate
        kind = rng.integers(3)
        if kind == 0:
            parts.append(np.full(count, rng.normal()))
        elif kind == 1:
            parts.append(rng.uniform(0.3, 1.5) * np.sin(2 * np.pi * rng.uniform(0.1, 2.0) * t))
        else:
            parts.append(np.zeros(count))
    return np.concatenate(parts)[:samples]


def record(name: str, u: FloatArray, y: FloatArray, rate: float = 50.0) -> Record:
    return Record(name, np.arange(len(u)) / rate, u, y, rate, Units())
