"""The Hammerstein-Wiener system that the axis is without a fault, and the least-squares refit of its base.

scipy alone computes here: these numbers set how strong the faults of a blind check are, so they must not come
from the code that is checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, signal

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.plant.run import Axis

BASE_NAMES = ("saturation.lower", "saturation.upper", "dead_zone.half_width", "gain")
MOST_EVALUATIONS = 12
SMALLEST_SCALE = 1e-4
LARGEST_DAMPING = 0.6
LARGEST_ERROR = 1e6
"""In spreads of the records; keeps a runaway trial step finite."""


@dataclass(frozen=True)
class Nominal:
    """G(z) = gain prod(z - zeros) / prod(z - poles) times the pole pairs of `modes`; limits and dead zone.

    `fixed_poles` are the poles other than the modes; each mode is (frequency in Hz, damping ratio).
    """

    lower: float
    upper: float
    half_width: float
    gain: float
    modes: tuple[tuple[float, float], ...]
    zeros: ComplexArray
    fixed_poles: ComplexArray
    delay_samples: int
    sample_rate_hz: float

    def poles(self) -> ComplexArray:
        """Every pole of G."""
        pairs = [_pole(f, z, self.sample_rate_hz) for f, z in self.modes]
        return np.concatenate([self.fixed_poles, *[[p, p.conjugate()] for p in pairs]])

    def simulate(self, command: FloatArray) -> FloatArray:
        """y without noise, from rest."""
        delayed = np.concatenate([np.zeros(self.delay_samples), command])[: len(command)]
        v = np.clip(delayed, self.lower, self.upper)
        excess = len(self.fixed_poles) + 2 * len(self.modes) - len(self.zeros)
        shifted = np.concatenate([np.zeros(excess), v])[: len(command)]
        w = np.asarray(signal.sosfilt(self._sections(), shifted), dtype=np.float64)
        return np.maximum(w - self.half_width, 0.0) + np.minimum(w + self.half_width, 0.0)

    def _sections(self) -> FloatArray:
        """G without its excess of poles over zeros, in powers of 1/z, shape (sections, 6)."""
        numerators, denominators = _quadratics(self.zeros), _quadratics(self.poles())
        idle = np.tile([1.0, 0.0, 0.0], (len(denominators) - len(numerators), 1))
        sections = np.hstack([np.concatenate([numerators, idle]), denominators])
        sections[0, :3] *= self.gain
        return sections

    def vector(self) -> FloatArray:
        """The base parameters: limits, half width, gain, then frequency and damping of every mode."""
        return np.array([self.lower, self.upper, self.half_width, self.gain, *np.ravel(self.modes)])

    def with_vector(self, values: FloatArray) -> Nominal:
        """The same with other base parameters."""
        lower, upper, half_width, gain, *modes = (float(value) for value in values)
        pairs = tuple(zip(modes[::2], modes[1::2], strict=True))
        return replace(self, lower=lower, upper=upper, half_width=half_width, gain=gain, modes=pairs)

    def base(self, sigma: float) -> dict[str, float]:
        """The base parameters under the names of posterior.json."""
        named = dict(zip(BASE_NAMES, self.vector().tolist(), strict=False))
        for number, (frequency, damping) in enumerate(self.modes, start=1):
            named[f"mode{number}.frequency_hz"], named[f"mode{number}.damping_ratio"] = frequency, damping
        return named | {"noise.sigma": sigma}

    def to_dict(self, name: str, sigma: float) -> dict[str, object]:
        """The content of model.json."""
        return {
            "name": name,
            "sample_rate_hz": self.sample_rate_hz,
            "units": {"time": "s", "input": "deg/s", "output": "deg"},
            "saturation": {"lower": self.lower, "upper": self.upper},
            "linear": {
                "zeros": [[z.real, z.imag] for z in self.zeros.tolist()],
                "poles": [[p.real, p.imag] for p in self.poles().tolist()],
                "gain": self.gain,
                "delay_samples": self.delay_samples,
            },
            "dominant_modes": [{"frequency_hz": f, "damping_ratio": z} for f, z in self.modes],
            "dead_zone": {"half_width": self.half_width},
            "noise": {"sigma": sigma},
        }


def nominal_of(axis: Axis) -> Nominal:
    """The system that the axis is exactly when it has no fault: zero-order-hold discretization."""
    drive = axis.drive.sampled(axis.sample_rate_hz)
    modes = axis.drive.modes()
    light = [_pole(f, z, axis.sample_rate_hz) for f, z in modes]
    fixed = [p for p in drive.poles if all(min(abs(p - q), abs(p - q.conjugate())) > 1e-9 for q in light)]
    return Nominal(
        axis.lower,
        axis.upper,
        axis.dead_zone,
        drive.gain,
        tuple(modes),
        drive.zeros,
        np.array(fixed, dtype=np.complex128),
        axis.delay_samples,
        axis.sample_rate_hz,
    )


def refit(
    nominal: Nominal,
    commands: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    start: Nominal | None = None,
) -> Nominal:
    """The base parameters near those of `nominal` that fit the records best in least squares.

    Near: limits, gain and frequencies within 30 %, damping within a factor of 4, half width up to three times
    as large. Without bounds a mode damped beyond recognition absorbs, say, a delay, which nobody would take
    for the axis; with frequencies held closer, a resonance in the load that merely lowers those of the drive
    would count as a gap. The search begins at `start` where one is given.
    """
    centre = nominal.vector()
    lowest, highest = _bounds(centre)
    scale = np.maximum(np.abs(centre), SMALLEST_SCALE)
    inside = 1e-3 * (highest - lowest)
    first = centre if start is None else np.clip(start.vector(), lowest + inside, highest - inside)
    target = np.concatenate(measured)
    spread = max(float(np.std(target)), 1e-12)

    def residual(scaled: FloatArray) -> FloatArray:
        model = nominal.with_vector(scaled * scale)
        error = np.concatenate([model.simulate(u) for u in commands]) - target
        return np.clip(error / spread, -LARGEST_ERROR, LARGEST_ERROR)

    solution = optimize.least_squares(
        residual,
        first / scale,
        bounds=(lowest / scale, highest / scale),
        x_scale="jac",
        max_nfev=MOST_EVALUATIONS,
        ftol=1e-3,
        xtol=1e-6,
        diff_step=[1e-6],
    )
    return nominal.with_vector(solution.x * scale)


def _bounds(start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest base parameters of a refit."""
    lowest, highest = np.minimum(0.7 * start, 1.3 * start), np.maximum(0.7 * start, 1.3 * start)
    lowest[2], highest[2] = 0.0, max(3 * start[2], SMALLEST_SCALE)
    lowest[5::2], highest[5::2] = start[5::2] / 4, np.minimum(4 * start[5::2], LARGEST_DAMPING)
    return lowest, highest


def _quadratics(roots: ComplexArray) -> FloatArray:
    """Coefficients of (1 - a/z)(1 - b/z) for conjugate pairs and for real roots two by two, shape (n, 3)."""
    upper = roots[roots.imag > 0]
    real = roots[roots.imag == 0].real
    real = np.concatenate([real, np.zeros(len(real) % 2)]).reshape(-1, 2)
    pairs = np.column_stack([np.ones(len(upper)), -2 * upper.real, np.abs(upper) ** 2])
    couples = np.column_stack([np.ones(len(real)), -real.sum(axis=1), real.prod(axis=1)])
    return np.concatenate([pairs, couples])


def _pole(frequency_hz: float, damping_ratio: float, sample_rate_hz: float) -> complex:
    s = 2 * np.pi * frequency_hz * complex(-damping_ratio, np.sqrt(1 - damping_ratio**2))
    return complex(np.exp(s / sample_rate_hz))
