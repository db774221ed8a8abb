"""Axes of MuJoCo, their sizes, faults and records."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.draws import Limits, Plant
from bayes_hw.plant.effects import CATALOGUE as HOME_CATALOGUE
from bayes_hw.plant.effects.effect import faults_of, with_own
from bayes_hw.plant.foreign import mechanics, unnamed
from bayes_hw.plant.foreign.simulation import ForeignAxis, ForeignRun, mujoco, substeps_for
from bayes_hw.plant.foreign.train import draw_train
from bayes_hw.plant.nominal import Nominal, system_of


def discrete_system(axis: ForeignAxis) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(A, B, C) over one sample with v held, state: angles, speeds, integral, two filters, current; deg."""
    package, train, dt = mujoco(), axis.train, axis.step_s
    model, loop, n = axis.mechanism, train.loop, len(train.inertias)
    data = package.MjData(model)
    size = 2 * n + 4
    integral, slow_speed, slow_v, current = range(2 * n, 2 * n + 4)
    lag = 1.0 if loop.current_s <= 0 else -float(np.expm1(-dt / loop.current_s))

    def step(x: FloatArray, v: float) -> FloatArray:
        """One physics step; the loop as in the simulation."""
        speed = x[n + train.motor]
        error = v - speed
        asked = loop.kp * error + loop.ki * x[integral]
        new = x.copy()
        if loop.kd:
            asked -= loop.kd * (speed - x[slow_speed]) / loop.filter_s
            new[slow_speed] += dt / loop.filter_s * (speed - x[slow_speed])
        if loop.ff:
            asked += loop.ff * (v - x[slow_v]) / loop.filter_s
            new[slow_v] += dt / loop.filter_s * (v - x[slow_v])
        new[integral] += dt * error
        new[current] += lag * (asked - x[current])
        package.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = x[:n], x[n : 2 * n]
        data.qfrc_applied[train.motor] = new[current]
        package.mj_step(model, data)
        new[:n], new[n : 2 * n] = data.qpos, data.qvel
        return new

    a = np.column_stack([step(unit, 0.0) for unit in np.eye(size)])
    b = step(np.zeros(size), 1.0)
    whole, forcing = np.eye(size), np.zeros(size)
    for _ in range(axis.substeps):
        forcing = a @ forcing + b
        whole = a @ whole
    used = np.ones(size, dtype=bool)
    used[integral], used[slow_speed], used[slow_v] = loop.ki != 0, loop.kd != 0, loop.ff != 0
    used[current] = lag < 1
    c = np.zeros(size)
    c[train.encoder] = 1.0
    return whole[np.ix_(used, used)], forcing[used], c[used]


CATALOGUE = with_own(HOME_CATALOGUE, faults_of(mechanics))
UNNAMED = faults_of(unnamed)
"""Faults whose label is `other`."""

HIGHEST_MODE = 0.35


class ForeignPlant(Plant):
    """Axes of MuJoCo."""

    catalogue = CATALOGUE
    unnamed = UNNAMED

    def make_axis(self, rng: np.random.Generator, limits: Limits, delay: int, rate: float) -> ForeignAxis:
        train = draw_train(rng, min(HIGHEST_MODE * rate, 9.0))
        return ForeignAxis(train, *limits, 0.0, delay, rate, substeps_for(train, rate))

    def nominal_of(self, axis: ForeignAxis) -> Nominal:
        """By steps of the simulation itself."""
        return system_of(axis, *discrete_system(axis))

    def begin(self, axis: ForeignAxis, command: FloatArray, seed: tuple[int, ...]) -> ForeignRun:
        return ForeignRun(axis, command, seed)

    def inertia_and_stiffness(self, axis: ForeignAxis) -> tuple[float, float]:
        """Torques in deg/s^2 of a load of 1 kg m^2: those that accelerate what hangs on the gear's spring."""
        return axis.train.inertia, axis.train.springs[axis.train.gear].stiffness
