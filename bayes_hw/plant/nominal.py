"""The Hammerstein-Wiener system that the axis is without a fault, and the least-squares refit of its base.

scipy alone computes here: these numbers set how strong the faults of a blind check are, so they must not come
from the code that is checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, signal
from scipy.linalg import eig

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.plant.run import Axis, LimitedAxis

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


LIGHT = 0.25
"""Largest damping ratio of a dominant mode."""

MOST_MODES = 2
CANCELLED = 1e-7
HIGHEST = 0.42
"""Of the sample rate: modes above are not dominant."""

NEGLIGIBLE = 1e-11


class UnfitAxisError(RuntimeError):
    """An axis that is unstable, has no light mode, or whose G is not found to the accuracy needed."""


def system_of(axis: LimitedAxis, a: FloatArray, b: FloatArray, c: FloatArray) -> Nominal:
    """Limits, dead zone and delay of the axis around x' = a x + b v, w = c x; raises UnfitAxisError."""
    poles = np.linalg.eigvals(a).astype(np.complex128)
    poles[np.argmin(np.abs(poles - 1))] = 1.0
    others = poles[poles != 1.0]
    if np.any(np.abs(others) > 0.9985):
        raise UnfitAxisError("an unstable or hardly damped axis")
    markov = _markov(a, b, c, 2 * len(poles) + 2)
    relative = int(np.argmax(np.abs(markov) > NEGLIGIBLE * np.abs(markov).max()))
    zeros = _zeros(a, b, c, len(poles) - relative)
    poles, zeros = _without_cancelled(poles, zeros)
    modes, fixed = _modes(poles, axis.sample_rate_hz)
    found = Nominal(
        axis.lower, axis.upper, axis.dead_zone, float(markov[relative]), modes, zeros, fixed,
        axis.delay_samples, axis.sample_rate_hz,
    )  # fmt: skip
    _check(found, a, b, c)
    return found


def _markov(a: FloatArray, b: FloatArray, c: FloatArray, count: int) -> FloatArray:
    """Samples 0, 1, ... of the impulse response."""
    found, x = [0.0], b
    for _ in range(count):
        found.append(float(c @ x))
        x = a @ x
    return np.array(found)


def _zeros(a: FloatArray, b: FloatArray, c: FloatArray, count: int) -> ComplexArray:
    """The finite zeros of the Rosenbrock pencil."""
    n = len(a)
    left = np.zeros((n + 1, n + 1))
    left[:n, :n], left[:n, n], left[n, :n] = a, b, c
    right = np.zeros_like(left)
    right[:n, :n] = np.eye(n)
    found = eig(left, right, right=False)
    size = np.where(np.isfinite(found), np.abs(found), np.inf)
    kept = found[np.argsort(size)[:count]].astype(np.complex128)
    if not np.isfinite(kept).all():
        raise UnfitAxisError("zeros at infinity")
    real = np.abs(kept.imag) < 1e-9 * np.maximum(np.abs(kept), 1e-3)
    kept[real] = kept[real].real
    return kept


def _without_cancelled(poles: ComplexArray, zeros: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    left, kept = list(zeros), []
    for pole in poles:
        near = min(left, key=lambda z: abs(z - pole), default=None)
        if near is not None and abs(near - pole) < CANCELLED:
            left.remove(near)
        else:
            kept.append(pole)
    return np.array(kept), np.array(left)


def _modes(poles: ComplexArray, rate_hz: float) -> tuple[tuple[tuple[float, float], ...], ComplexArray]:
    """(frequency, damping) of the dominant modes and the other poles."""
    upper = poles[(poles.imag > 1e-9) & (np.abs(poles) > 1e-6)]
    s = np.log(upper) * rate_hz
    light = sorted(
        (abs(x) / (2 * np.pi), -x.real / abs(x), pole)
        for x, pole in zip(s, upper, strict=True)
        if -x.real / abs(x) < LIGHT and abs(x) / (2 * np.pi) < HIGHEST * rate_hz
    )[:MOST_MODES]
    if not light:
        raise UnfitAxisError("no light mode")
    taken = [p for _, _, pole in light for p in (pole, pole.conjugate())]
    fixed = [p for p in poles if all(abs(p - q) > 1e-12 for q in taken)]
    return tuple((float(f), float(z)) for f, z, _ in light), np.array(fixed, dtype=np.complex128)


def _check(found: Nominal, a: FloatArray, b: FloatArray, c: FloatArray) -> None:
    """Raise UnfitAxisError where roots and gain do not answer a square wave as the matrices do."""
    length = 800
    v = np.sign(np.sin(np.arange(length) / 17.0)) * min(found.upper, -found.lower)
    x, exact = np.zeros(len(a)), np.empty(length)
    for k in range(length):
        exact[k] = c @ x
        x = a @ x + b * v[k]
    delayed = np.concatenate([v, np.zeros(found.delay_samples)])
    w = Nominal(
        found.lower, found.upper, 0.0, found.gain, found.modes, found.zeros, found.fixed_poles,
        found.delay_samples, found.sample_rate_hz,
    ).simulate(delayed)[found.delay_samples :]  # fmt: skip
    if not np.max(np.abs(w - exact)) < 1e-7 * np.ptp(exact):
        raise UnfitAxisError("roots not found to the accuracy needed")
