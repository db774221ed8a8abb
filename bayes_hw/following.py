"""How the speed of an angle follows a command, from their cross-spectra at low frequencies.

Welch's averages over `PARTS` stretches and their halves, in bands of half an octave. Where drive and
structure are slow to matter, the transfer from a velocity command to the speed of the angle is flat and in
phase; from a position command it rises as frequency and leads by a quarter of a turn; from an angle to the
speed of a velocity command, as where the two are swapped, it rises as frequency squared and is opposed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.integral_regression import integral_regression

FEWEST_SAMPLES = 128
MOST_SAMPLES = 2**15
"""Longer records are averaged over blocks to so many."""

PARTS = 8
"""Stretches that spectra are averaged over, overlapping by half."""

LEAST_DENSITY = 0.1
"""Command in a band, over that in the strongest, below which the band is left out."""

COHERENT = 0.5
BESIDE_BEST = 0.8
"""Squared coherence at which a band tells of the transfer, and its share of the best band's."""

REACH = 4.0
"""Bands up to so many times the lowest coherent frequency are looked at."""

GAIN_REACH = 2.0
"""And up to so many times it for the gain."""

WIDE = 1.4
"""Ratio of frequencies that tells a steepness."""

CLEAR = 0.6
"""Correlation beyond which scale and relation are believed."""

CERTAIN = 0.8

LEADS = 45.0
LAGS = -80.0
OPPOSED = 145.0
"""Phases, in degrees, up to which an angle in motion may lead its command, down to which it may lag, and
beyond which, in size, it runs against it."""

NEARER = 40.0
"""Degrees by which the phase of one direction must be nearer to zero where both move with the command."""

Relation: TypeAlias = Literal["follows", "inverted", "swapped", "derivative", "unclear"]


@dataclass(frozen=True)
class Following:
    """How the speed of an angle follows a command.

    `correlation` is the root of the coherence at the lowest frequencies where both tell of each other, zero
    to one; `gain` speed over command there; `phase_deg` that towards zero frequency; `steepness` the power
    of the frequency with which the gain rises, None where the command holds one frequency alone.
    Where no band tells, `gain` and `phase_deg` are zero and `correlation` the largest of any.
    """

    correlation: float
    gain: float = 0.0
    phase_deg: float = 0.0
    steepness: float | None = None

    @property
    def is_clear(self) -> bool:
        """Whether a gain and a phase are there to believe."""
        return self.gain > 0 and self.correlation > CLEAR

    @property
    def is_forward(self) -> bool:
        """Whether the angle moves with the command, neither opposed nor as the command's own derivative."""
        return self.is_clear and LAGS < self.phase_deg < LEADS

    @property
    def is_opposed(self) -> bool:
        return self.is_clear and abs(self.phase_deg) > OPPOSED

    @property
    def signed(self) -> float:
        """The correlation, negative where the angle runs against the command."""
        return math.copysign(self.correlation, math.cos(math.radians(self.phase_deg)))


class _Band(NamedTuple):
    """Sums of the spectra over one band; frequency in cycles a sample."""

    frequency: float
    density: float
    command: float
    speed: float
    cross: complex

    @property
    def coherence(self) -> float:
        return abs(self.cross) ** 2 / (self.command * self.speed)


def following(command: FloatArray, angle: FloatArray, rate_hz: float) -> Following | None:
    """How the speed of `angle` follows `command`, both of shape (samples,); None where they are shorter than
    `FEWEST_SAMPLES` or one is constant."""
    width = -(-len(angle) // MOST_SAMPLES)
    blocks = (len(angle) - 1) // width
    speed = np.diff(angle[: blocks * width + 1 : width]) / width
    held = command[: blocks * width].reshape(blocks, width).mean(axis=1)
    if len(speed) < FEWEST_SAMPLES or np.ptp(held) == 0 or np.ptp(speed) == 0:
        return None
    bands = _bands(held, speed)
    strongest = max((band.density for band in bands), default=0.0)
    bands = [band for band in bands if band.density > LEAST_DENSITY * strongest]
    if not bands:
        return Following(0.0)
    best = max(band.coherence for band in bands)
    telling = [band for band in bands if band.coherence > max(COHERENT, BESIDE_BEST * best)]
    if not telling:
        return Following(math.sqrt(best))
    lowest = telling[0].frequency
    some = [band for band in telling if band.frequency <= REACH * lowest]
    few = [band for band in some if band.frequency <= GAIN_REACH * lowest]
    command_sum, speed_sum = sum(band.command for band in few), sum(band.speed for band in few)
    cross = abs(sum(band.cross for band in few))
    phase, steepness = _towards_zero(some)
    correlation = min(cross / math.sqrt(command_sum * speed_sum), 1.0)
    return Following(correlation, cross / command_sum * rate_hz, phase, steepness)


def relation(command: FloatArray, angle: FloatArray, rate_hz: float) -> Relation:
    """What the two columns of shape (samples,) are to each other.

    "derivative" is an angle that moves as the command itself does, as behind a position command; "swapped" a
    command that follows the angle as a speed does.
    """
    forward = following(command, angle, rate_hz)
    if forward is None:
        return "unclear"
    back = following(angle, command, rate_hz)
    if back is not None and back.is_forward and back.correlation > CERTAIN and _is_rather(back, forward):
        return "swapped"
    if forward.is_forward:
        return "follows"
    if forward.is_opposed and forward.correlation > CERTAIN and _runs_back(command, angle, rate_hz):
        return "inverted"
    leads = forward.is_clear and LEADS <= forward.phase_deg <= OPPOSED
    return "derivative" if leads else "unclear"


def _runs_back(command: FloatArray, angle: FloatArray, rate_hz: float) -> bool:
    """Whether the angle's level clearly falls as the command's integral rises: beyond a resonance an angle
    runs against a command that it follows in the long run, and one that creeps does so of either."""
    return integral_regression(command, angle, rate_hz).correlation < -CLEAR


def _is_rather(one: Following, other: Following) -> bool:
    """Whether `one` of both directions, in which the angle moves with the command, is the one that is so.

    An opposed transfer that depends less on the frequency is that of an inverted sign.
    """
    if other.is_forward:
        return abs(one.phase_deg) + NEARER < abs(other.phase_deg)
    if not other.is_opposed:
        return True
    if one.steepness is None or other.steepness is None:
        return one.correlation > other.correlation
    return abs(one.steepness) < abs(other.steepness)


def _bands(command: FloatArray, speed: FloatArray) -> list[_Band]:
    """Spectra of command and speed, and between them, by bands of half an octave."""
    length = len(speed) // PARTS
    window = np.hanning(length + 2)[1:-1]
    ramp = np.arange(length) - (length - 1) / 2
    ramp /= np.linalg.norm(ramp)
    own, other = np.zeros(length // 2 + 1), np.zeros(length // 2 + 1)
    cross = np.zeros(length // 2 + 1, dtype=np.complex128)
    for first in np.linspace(0, len(speed) - length, 2 * PARTS - 1).astype(int):
        u, v = (
            np.fft.rfft((part - part.mean() - (part @ ramp) * ramp) * window)
            for part in (command[first : first + length], speed[first : first + length])
        )
        own += np.abs(u) ** 2
        other += np.abs(v) ** 2
        cross += u.conj() * v
    edges = [1]
    while edges[-1] < len(own):
        edges.append(min(max(edges[-1] + 1, math.ceil(edges[-1] * math.sqrt(2))), len(own)))
    frequency = np.arange(len(own)) / length
    found = []
    for low, high in itertools.pairwise(edges):
        held, moved = float(own[low:high].sum()), float(other[low:high].sum())
        if held > 0 and moved > 0:
            centre = float(own[low:high] @ frequency[low:high]) / held
            found.append(_Band(centre, held / (high - low), held, moved, complex(cross[low:high].sum())))
    return found


def _towards_zero(bands: list[_Band]) -> tuple[float, float | None]:
    """Phase in degrees at zero frequency, a delay taken out, and steepness of the gain."""
    frequency = np.array([band.frequency for band in bands])
    transfer = np.array([band.cross / band.command for band in bands])
    phase = np.unwrap(np.angle(transfer))
    if frequency[-1] < WIDE * frequency[0]:
        return math.degrees(math.remainder(float(phase[0]), math.tau)), None
    weights = np.array([band.coherence for band in bands])
    slope, level = np.polyfit(frequency, phase, 1, w=weights)
    if slope > 0:
        level = phase.mean()
    steepness = float(np.polyfit(np.log(frequency), np.log(np.abs(transfer)), 1, w=weights)[0])
    return math.degrees(math.remainder(float(level), math.tau)), steepness
