"""The torque-level drive train behind a given G(z).

Where the poles and zeros of G are those of a motor with a proportional-integral velocity loop, a gear
compliance, a load and one structural mode hung on it, its stiffnesses can be read back from G. In units of
acceleration, with v the limited command and theta_m, theta, theta_s the angles of motor, load and structure:

    theta_m'' = kp (v - theta_m') + ki (integral of v - theta_m) - km tau + torque_motor
    theta''   = kl tau - bl theta' - ks (psi + cs psi') + torque_load
    theta_s'' = kss (psi + cs psi'),       tau = phi + c phi',   phi = theta_m - theta,  psi = theta - theta_s
    w         = gain theta
    (angles and torques below are in units of w, that is, times gain)

(two-inertia drives: Schuetz and Thyen, doi 10.1002/9783527691807; PI velocity loop, integrating position).
The effects that act as torques need the paths from a torque to w and from the command to the motor's
speed. Both have the poles of G, and at a pole the ratio of two paths is a ratio of polynomials, so that G
itself stays exactly as given and the drive train supplies ratios only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg.lapack import dgeev

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray
from bayes_hw.gap.simulate.continuous_poles import ContinuousPoles
from bayes_hw.gap.simulate.drive_train_kernel import (
    command_path,
    companion,
    numerators,
    resonant,
    torque_path,
    torque_polynomials,
    upper_ones,
    usual_logs,
)
from bayes_hw.gap.simulate.match_kernel import COUNT, CS, KSS, matched
from bayes_hw.gap.simulate.path import Path, ordered
from bayes_hw.gap.simulate.resonator import Resonator

FREQUENCIES = 40
LARGEST_MISFIT = 0.2
"""Relative misfit of the frequency response above which G is not that of this drive train."""

MISFIT_ROUNDS = 14
ROUNDS_FROM_NEAR = 10
STEPS_PER_ROUND = 3
FIRST_MISFIT = 0.03
SMALLEST_MISFIT = 1e-6
LARGEST_STEP = 0.5
USUAL_LOG_SD = np.array([0.15, 0.2, 0.4, 0.2, 0.5, 0.1, 0.6, 0.4, 0.6, 0.3])
"""How far drives stray from the usual proportions: kp, ki, km, kl, ks, kss, c, cs, bl, gain."""

ANTIRESONANCES = (0.0, -0.15, -0.3, -0.45)
"""Logarithms of the structure's own stiffness over the usual one from which a G is matched: where modes and
zeros of a given G do not quite belong together, the nearest match may be of another antiresonance."""

_STRUCTURE = np.eye(COUNT)[KSS]

RIGID, NOTHING_TAKEN = np.ones(1), np.zeros(1)
"""A resonator's own polynomial and what it takes, where there is none."""

VELOCITY_LOOP_CORNER = 10.0
"""rad/s; where a torque is rejected when the drive train is not known: the integral time of usual loops."""


def resonant_poles(
    poles: ComplexArray,
    residues: ComplexArray,
    host_residues: ComplexArray,
    real: BoolArray,
    resonator: Resonator,
) -> tuple[ComplexArray, ComplexArray]:
    """Upper poles and residues of G / (1 + X H): G and H, from load torque to the host's angle, as residues
    (n,) at upper `poles` (n,), X what the resonator takes; an integrator of G stays one."""
    every, of_g, of_host = (
        np.concatenate([upper, upper[~real].conj()]) for upper in (poles, residues, host_residues)
    )
    denominator, (numerator, host_numerator) = numerators(every, np.stack([of_g, of_host]))
    taken = np.polymul(resonator.resisting, host_numerator)
    closed = np.polyadd(np.polymul(denominator, resonator.own), taken)
    found = np.roots(closed).astype(np.complex128)
    nearest = np.argmin(np.abs(found))
    found[nearest] = 0.0 if np.any(poles == 0) else found[nearest]
    found = found[found.imag >= 0]
    passed = np.polyval(numerator, found) * np.polyval(resonator.own, found)
    return found, np.asarray(passed / np.polyval(np.polyder(closed), found), np.complex128)


@dataclass(frozen=True)
class UnknownTrain:
    """Torque paths where G is not that of the drive train above: G itself behind a velocity loop.

    A torque is rejected below the corner of the loop: its path is s / (bandwidth (s + corner)) G. Motor and
    load move as one.
    """

    corner: float = VELOCITY_LOOP_CORNER
    bandwidth: float = 15 * VELOCITY_LOOP_CORNER

    def torque_path(self, system: ContinuousPoles, resonator: Resonator | None = None) -> Path:  # noqa: ARG002
        """The paths of both torques, from the poles and residues of G; without the resonator, whose host is
        not known."""
        s = np.concatenate([system.poles, [-self.corner + 0j]])
        at_corner = -self.corner * system.response(np.array([-self.corner + 0j]))
        residues = np.concatenate([system.residues * system.poles / (system.poles + self.corner), at_corner])
        ones = np.ones_like(s)
        inputs = np.stack([ones, ones]) / self.bandwidth
        return Path(*ordered(s, inputs, residues * np.array([ones, ones, s, s])))

    def command_path(
        self,
        system: ContinuousPoles,
        resonator: Resonator | None,
        torques: Path,  # noqa: ARG002
    ) -> Path:
        """The path from the command, of G or of G with a resonator: motor and load turn as w does."""
        s, r = system.poles, system.residues
        if resonator is not None:
            s, r = self._with_resonator(system, resonator)
        ones = np.ones_like(s)
        return Path(*ordered(s, ones[None], r * np.array([ones, ones, s, s])))

    def _with_resonator(
        self, system: ContinuousPoles, resonator: Resonator
    ) -> tuple[ComplexArray, ComplexArray]:
        """Poles and residues of G / (1 + X H), H from load torque to w, X what the resonator takes."""
        to_host = system.poles / (self.bandwidth * (system.poles + self.corner))
        by_host = system.residues * to_host
        return resonant_poles(system.poles, system.residues, by_host, system.real != 0, resonator)

    @property
    def stiffness(self) -> tuple[float, float]:
        """(km, kl) in 1/s^2: the acceleration of motor and load for a unit of torsion."""
        return self.corner * self.bandwidth, self.corner * self.bandwidth

    @property
    def contact_damping(self) -> float:
        """The damping time c of the compliance in s."""
        return 0.0


@dataclass(frozen=True)
class DriveTrain:
    """The drive train of the module's docstring; `logs` holds log(kp, ki, km, kl, ks, kss, c, cs, bl, gain).

    Shape (10,); units 1/s for kp, bl, 1/s^2 for ki and the stiffnesses, s for c and cs.
    """

    logs: FloatArray
    sign: float
    misfit: float

    def _polynomials(self, resonator: Resonator | None) -> tuple[FloatArray, ...]:
        """Those of `torque_polynomials`, with a resonator if given."""
        if resonator is None:
            return self._own_polynomials
        on_structure = resonator.on_structure
        return tuple(torque_polynomials(self.logs, resonator.own, resonator.resisting, on_structure))

    @cached_property
    def _own_polynomials(self) -> tuple[FloatArray, ...]:
        return tuple(torque_polynomials(self.logs, RIGID, NOTHING_TAKEN, False))

    def response(self, s: ComplexArray) -> ComplexArray:
        """w per v at `s`."""
        kp, ki, *_, gain = np.exp(self.logs)
        whole, _, _, across = self._polynomials(None)
        path = np.polyval(across, s) / np.polyval(whole, s)
        return np.asarray(self.sign * gain * (kp * s + ki) / s * path)

    def torque_path(self, system: ContinuousPoles, resonator: Resonator | None = None) -> Path:  # noqa: ARG002
        """The paths of both torques, from the poles of the drive train itself, a resonator on it if given.

        The integrator of the command does not answer to torques.
        """
        polynomials = self._polynomials(resonator)
        return Path(*torque_path(_upper_roots(polynomials[0]), *polynomials))

    def command_path(self, system: ContinuousPoles, resonator: Resonator | None, torques: Path) -> Path:
        """The path from the command, of G or of G with a resonator, given that of `torques` likewise."""
        s, r = system.poles, system.residues
        closed, hung, _, across = self._polynomials(resonator)
        if resonator is not None:
            s, r = self._with_resonator(system, resonator, torques.poles, closed, across)
        return Path(*command_path(s, r, hung, across))

    def _with_resonator(
        self,
        system: ContinuousPoles,
        resonator: Resonator,
        own: ComplexArray,
        closed: FloatArray,
        host_across: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Poles and residues of G times what the resonator does to the drive train's own response.

        `own` are the poles of `torque_path` with the resonator, `closed` and `host_across` its D and
        kl C S. Where G is not quite that of the drive train its own poles remain, with residues as small as
        the misfit: a loop closed around G itself can be unstable, for all that nothing in it gives energy.
        """
        whole, _, _, across = self._polynomials(None)
        kss, structural = np.exp(self.logs[KSS]), np.exp(self.logs[CS])
        hosted = own[:0]
        if resonator.on_structure:
            hosted = _upper_roots(np.array([1.0, kss * structural, kss]))
        residues = resonant(*system, own, hosted, whole, across, closed, host_across)
        return np.concatenate([system.poles, own, hosted]), np.asarray(residues)

    @property
    def stiffness(self) -> tuple[float, float]:
        """(km, kl) in 1/s^2: the acceleration of motor and load for a unit of torsion."""
        return float(np.exp(self.logs[2])), float(np.exp(self.logs[3]))

    @property
    def contact_damping(self) -> float:
        return float(np.exp(self.logs[6]))


def _upper_roots(polynomial: FloatArray) -> ComplexArray:
    """The real roots of a real polynomial and of every pair the upper one: eigenvalues of its companion."""
    real, imaginary, _, _, failed = dgeev(companion(polynomial), compute_vl=False, compute_vr=False)
    if failed or not np.isfinite(real).all():
        raise np.linalg.LinAlgError(f"no roots of a polynomial with the coefficients {polynomial}")
    return np.asarray(upper_ones(real, imaginary))


def realise(system: ContinuousPoles, rate: float, near: DriveTrain | None = None) -> DriveTrain | None:
    """The drive train with the frequency response of `system`, or None where there is none near.

    Least squares of the log response from 0.02 Hz to the folding frequency, from usual proportions of a
    drive or from a drive train `near`. G whose modes are a little off is no drive train exactly, and the
    stiffnesses it shows least would then take up its errors: the misfit that remains is their noise, against
    which the usual proportions hold them. An exact G has no misfit and is realised exactly. The number of
    steps is fixed, so that the result is a smooth function of G. It needs an integrator, two modes and two
    more real poles.
    """
    if len(system.poles) != 5 or np.count_nonzero(system.real) != 3 or not np.any(system.poles == 0):
        return None
    s = _matching_points(rate)
    target = system.response(s)
    sign = float(np.sign((target[0] * s[0]).real))
    usual = usual_logs(system.poles, system.real, abs(target[0] * s[0]))
    starts = [near.logs] if near is not None else [usual + shift * _STRUCTURE for shift in ANTIRESONANCES]
    matches = (
        matched(
            start,
            usual,
            USUAL_LOG_SD,
            FIRST_MISFIT,
            SMALLEST_MISFIT,
            MISFIT_ROUNDS if near is None else ROUNDS_FROM_NEAR,
            STEPS_PER_ROUND,
            LARGEST_STEP,
            np.ascontiguousarray(s.imag),
            target,
            sign,
        )
        for start in starts
    )
    logs, misfit = min(matches, key=lambda match: match[1])
    return DriveTrain(logs, sign, misfit) if misfit < LARGEST_MISFIT else None


@lru_cache(maxsize=8)
def _matching_points(rate: float) -> ComplexArray:
    points = np.asarray(1j * np.geomspace(0.1, 0.95 * np.pi * rate, FREQUENCIES), dtype=np.complex128)
    points.setflags(write=False)
    return points
