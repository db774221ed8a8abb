"""A drive train with known stiffnesses in state space, the axis that it makes, and records of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg
from simulated_records import coloured_noise

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale, axis_scale
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record, Units

RATE = 20.0
SIGMA = 0.004
V, MOTOR_TORQUE, LOAD_TORQUE = range(3)
W, MOTOR_ANGLE, MOTOR_SPEED, LOAD_SPEED = range(4)


@dataclass(frozen=True)
class KnownTrain:
    """`bayes_hw.gap.simulate.drive_train` by its own numbers, motor and load in units of w."""

    kp: float = 210.0
    ki: float = 2400.0
    km: float = 520.0
    kl: float = 190.0
    ks: float = 105.0
    kss: float = 530.0
    c: float = 0.003
    cs: float = 0.0016
    bl: float = 0.2
    gain: float = 0.75

    @property
    def logs(self) -> FloatArray:
        """In the order of `DriveTrain.logs`."""
        values = (self.kp, self.ki, self.km, self.kl, self.ks, self.kss, self.c, self.cs, self.bl, self.gain)
        return np.log(values)

    def state_space(
        self, resonator: tuple[float, float, float] | None = None, on_structure: bool = False
    ) -> tuple[FloatArray, ...]:
        """A, B for (v, motor torque, load torque), C for w, motor angle, motor speed, load speed.

        States: integral of gain v - motor angle, then angle and speed of motor, load and structure; with
        `resonator` (inertia ratio, frequency in Hz, damping ratio) angle and speed of a mass on the load, or
        on the structure, inertia over that of its host.
        """
        n = 7 if resonator is None else 9
        lag, motor, motor_speed, load, load_speed, structure, structure_speed = range(7)
        a, b = np.zeros((n, n)), np.zeros((n, 3))
        a[lag, motor_speed], b[lag, V] = -1, self.gain
        for angle in range(1, n, 2):
            a[angle, angle + 1] = 1
        tau = np.zeros(n)
        tau[[motor, load, motor_speed, load_speed]] = 1, -1, self.c, -self.c
        hung = np.zeros(n)
        hung[[load, structure, load_speed, structure_speed]] = 1, -1, self.cs, -self.cs
        a[motor_speed] = -self.km * tau
        a[motor_speed, motor_speed] -= self.kp
        a[motor_speed, lag] += self.ki
        a[load_speed] = self.kl * tau - self.ks * hung
        a[load_speed, load_speed] -= self.bl
        a[structure_speed] = self.kss * hung
        b[motor_speed, V] = self.kp * self.gain
        b[motor_speed, MOTOR_TORQUE] = b[load_speed, LOAD_TORQUE] = 1
        if resonator is not None:
            ratio, frequency, damping = resonator
            omega = 2 * np.pi * frequency
            host, host_speed = (structure, structure_speed) if on_structure else (load, load_speed)
            pull = np.zeros(n)
            pull[[host, 7]] = omega**2, -(omega**2)
            pull[[host_speed, 8]] = 2 * damping * omega, -2 * damping * omega
            a[8] = pull
            a[host_speed] -= ratio * pull
        return a, b, np.eye(n)[[load, motor, motor_speed, load_speed]]


TRAIN = KnownTrain()


def held(a: FloatArray, b: FloatArray, h: float) -> tuple[FloatArray, FloatArray]:
    """The state space of inputs held over steps of `h` seconds."""
    n, m = b.shape
    block = linalg.expm(np.block([[a, b], [np.zeros((m, n + m))]]) * h)
    return block[:n, :n], block[:n, n:]


def drive_axis(train: KnownTrain = TRAIN, rate: float = RATE, delay: int = 1) -> HammersteinWiener:
    """The axis whose G is the zero-order-hold equivalent of `train`, read by its poles and zeros."""
    a, b, c = train.state_space()
    ad, bd = held(a, b[:, [V]], 1 / rate)
    poles = linalg.eigvals(ad)
    poles[np.argmin(np.abs(poles - 1))] = 1.0
    pencil = np.block([[ad, bd], [c[[W]], np.zeros((1, 1))]])
    mass = np.diag([1.0] * len(ad) + [0.0])
    zeros = linalg.eigvals(pencil, mass)
    zeros = zeros[np.isfinite(zeros) & (np.abs(zeros) < 1e6)]
    assert len(zeros) == len(poles) - 1
    modes = tuple(Mode.from_pole(p, rate) for p in poles if p.imag > 1e-9)
    return HammersteinWiener(
        name="drive axis",
        sample_rate_hz=rate,
        saturation=Saturation(-0.3, 0.32),
        linear=LinearBlock(zeros, poles, gain=float((c[W] @ bd)[0]), delay_samples=delay),
        dead_zone=DeadZone(0.006),
        dominant_modes=modes,
        noise_sigma=SIGMA,
        units=Units(),
    )


def command(samples: int, seed: int, rate: float = RATE) -> FloatArray:
    """Steps, slow sines and rests: saturates, reverses, comes to a stop."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / rate
    steps = np.repeat(rng.normal(0, 0.25, size=samples // 25 + 1), 25)[:samples]
    slow = 0.25 * np.sin(2 * np.pi * t / 9 + rng.uniform(0, 6))
    rest = np.repeat(rng.random(samples // 60 + 1) < 0.2, 60)[:samples]
    return np.where(rest, 0.0, 0.6 * steps + slow)


def hypothesis(
    model: HammersteinWiener, inputs: list[FloatArray], *effects: Effect, sigma: float = SIGMA
) -> Hypothesis:
    """The base model of `model` with `effects` on the commands `inputs`."""
    builder = ChainBuilder(model)
    train = builder.train(builder.axis.nominal)
    return Hypothesis(builder, scale_of(model, inputs, train.stiffness, sigma), inputs, effects)


def scale_of(
    model: HammersteinWiener, inputs: list[FloatArray], stiffness: tuple[float, float], sigma: float
) -> AxisScale:
    """The scale of `model` where it runs as simulated."""
    rate = model.sample_rate_hz
    records = [
        Record(f"r{i}", np.arange(len(u)) / rate, u, model.simulate(u).y, rate, model.units)
        for i, u in enumerate(inputs)
    ]
    return axis_scale(model, records, sigma, stiffness)


def white(samples: int, sigma: float, seed: int) -> FloatArray:
    return np.random.default_rng(seed).normal(0, sigma, samples)


def coloured(samples: int, sigma: float, correlation: float, seed: int) -> FloatArray:
    """First-order noise of marginal `sigma`."""
    return coloured_noise(samples, sigma, correlation, np.random.default_rng(seed))


def frequency_response(a: FloatArray, b: FloatArray, c: FloatArray, s: FloatArray) -> FloatArray:
    """C (s I - A)^-1 B at every s: shape (s, outputs, inputs)."""
    eye = np.eye(len(a))
    return np.array([c @ np.linalg.solve(point * eye - a, b) for point in s])
