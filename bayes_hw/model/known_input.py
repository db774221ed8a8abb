"""Known inputs of a model: further measured columns that act on the axis beside its command.

A column counts from its level where a record begins, at which the axis rests. Through the load it acts as a
torque, which reaches w by the poles of G at residues of its own; at the encoder it is a part of the reading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np
from scipy import signal

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.errors import InputError

NO_COLUMNS: Mapping[str, FloatArray] = MappingProxyType({})

Way: TypeAlias = Literal["torque", "reading"]
TORQUE: Way = "torque"
READING: Way = "reading"

EIGHTH = complex(np.exp(0.25j * np.pi))

BEGINNING = 10
"""Samples whose mean is the level that a record begins at: the axis rests there under it."""


def delayed_column(
    known: Mapping[str, FloatArray], name: str, lag: float, samples: int
) -> tuple[FloatArray, FloatArray]:
    """The column `name`, less its level at the beginning, `lag` samples late, and its derivative by the lag,
    both (samples,).

    Between its samples it is straight, before the first the level. Raises InputError where there is no such
    column.
    """
    if name not in known:
        raise InputError(f"the model takes the known input {name!r}; read it with --known {name}")
    column = known[name]
    counted = column - column[: min(BEGINNING, len(column))].mean()
    whole = int(np.floor(lag))
    share = lag - whole
    newer, older = _late(counted, whole, samples), _late(counted, whole + 1, samples)
    return (1 - share) * newer + share * older, older - newer


def typical_cycles(columns: Sequence[FloatArray]) -> float:
    """Cycles per sample below which half of the power of columns (samples,) lies, their mean left out."""
    frequencies, powers = [], []
    for column in columns:
        transform = np.fft.rfft((column - column.mean()) * np.hanning(len(column) + 2)[1:-1])
        frequencies.append(np.fft.rfftfreq(len(column))[1:])
        powers.append(np.abs(transform[1:]) ** 2)
    f, p = np.concatenate(frequencies), np.concatenate(powers)
    order = np.argsort(f)
    summed = np.cumsum(p[order])
    return float(f[order][np.searchsorted(summed, 0.5 * summed[-1])])


def polar(through: complex, cycles: float, delay: float) -> tuple[float, float]:
    """Gain and lag in samples of a response at `cycles` per sample behind a delay in samples.

    The sign is that for which the response lags by three eighths of a turn at most and leads by an eighth: a
    spring, which does not lag, and an integrator, which lags by a quarter, are as far as can be from where
    the sign turns over.
    """
    sign = 1.0 if (through * EIGHTH).real >= 0 else -1.0
    return sign * abs(through), delay - float(np.angle(sign * through)) / (2 * np.pi * cycles)


def _late(column: FloatArray, lag: int, samples: int) -> FloatArray:
    found = np.zeros(samples)
    if lag < samples:
        begin = max(lag, 0)
        part = column[begin - lag : samples - lag]
        found[begin : begin + len(part)] = part
        if lag < 0:
            found[len(part) :] = column[-1]
    return found


@dataclass(frozen=True, eq=False)
class KnownInput:
    """One column: as a `torque` it adds gain H(z) x to w, as a `reading` gain x to the encoder's angle, with
    x the column `delay_samples` late.

    H(z) = sum_i residues_i z^-1 / (1 - poles_i z^-1) is one in magnitude at `cycles` per sample, a frequency
    typical of the column. `gain` is in output units a `unit` of the column.
    """

    column: str
    way: Way
    gain: float
    delay_samples: float
    cycles: float
    unit: str = ""
    poles: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))
    residues: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))

    @property
    def lag_samples(self) -> float:
        """By how many samples the angle follows the column at its typical frequency."""
        return float(self.strength(self.coefficients[:, None])[1][0])

    @cached_property
    def coefficients(self) -> FloatArray:
        """Of `signals` (n,): their sum is what the column adds."""
        if self.way == READING:
            return np.array([self.gain, 0.0])
        return self.gain * np.array([1.0 if real else 0.0 for real, _ in self._shares])

    @cached_property
    def sizes(self) -> FloatArray:
        """Magnitudes (n,) of the signals' responses at the typical frequency."""
        return np.abs(self._transfers)

    def signals(self, known: Mapping[str, FloatArray], samples: int) -> FloatArray:
        """What a unit of each coefficient adds to w, or to the reading, (n, samples): of a torque one for
        every real pole and two for every pair, the delay held; of a reading the column and its derivative by
        the delay in samples. Raises InputError where the column is missing."""
        shown, by_delay = delayed_column(known, self.column, self.delay_samples, samples)
        if self.way == READING:
            return np.stack([shown, by_delay])
        column = shown.astype(np.complex128)
        filtered = np.stack([signal.lfilter([0.0, 1.0], [1.0, -pole], column) for pole in self.poles])
        return np.asarray((self._weights @ filtered).real, dtype=np.float64)

    def added(self, known: Mapping[str, FloatArray], samples: int) -> FloatArray:
        """What the column adds to w, or to the reading, (samples,)."""
        return np.asarray(self.coefficients @ self.signals(known, samples))

    def strength(self, coefficients: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gain and lag in samples, (walkers,) each, of coefficients (n, walkers) at the typical frequency."""
        if self.way == READING:
            gain = coefficients[0]
            return gain, self.delay_samples + coefficients[1] / gain
        found = [polar(complex(h), self.cycles, self.delay_samples) for h in self._transfers @ coefficients]
        gain, lag = np.array(found, dtype=np.float64).reshape(-1, 2).T
        return gain, lag

    def with_coefficients(self, coefficients: FloatArray) -> KnownInput:
        """The same with other coefficients (n,)."""
        gain = float(self.strength(coefficients[:, None])[0][0])
        if self.way == READING:
            return replace(self, gain=gain, delay_samples=self.delay_samples + float(coefficients[1]) / gain)
        return replace(self, gain=gain, residues=coefficients @ self._weights / gain)

    @cached_property
    def _shares(self) -> list[tuple[bool, ComplexArray]]:
        """For every coefficient of a torque whether it is one where the model stands, and the residues that a
        unit of it puts on the poles."""
        found = []
        for i, pole in enumerate(self.poles):
            if pole.imag < 0:
                continue
            for turned in (1.0,) if pole.imag == 0 else (1.0, 1j):
                own = np.zeros(len(self.poles), dtype=np.complex128)
                own[i] = turned * self.residues[i]
                if pole.imag > 0:
                    own[int(np.argmin(np.abs(self.poles - np.conj(pole))))] = np.conj(own[i])
                found.append((turned == 1.0, own))
        return found

    @cached_property
    def _weights(self) -> ComplexArray:
        return np.array([own for _, own in self._shares], dtype=np.complex128)

    @cached_property
    def _transfers(self) -> ComplexArray:
        """Of every signal at the typical frequency, the delay left out: (n,)."""
        q = np.exp(-2j * np.pi * self.cycles)
        if self.way == READING:
            return np.array([1.0, q - 1.0], dtype=np.complex128)
        return np.asarray(self._weights @ (q / (1 - self.poles * q)), dtype=np.complex128)

    def to_dict(self, sample_rate_hz: float) -> dict[str, Any]:
        """One entry of the key "known" of model.json."""
        return {
            "column": self.column,
            "unit": self.unit,
            "way": self.way,
            "gain": self.gain,
            "lag_s": self.lag_samples / sample_rate_hz,
            "frequency_hz": self.cycles * sample_rate_hz,
            "delay_samples": self.delay_samples,
            "poles": [[p.real, p.imag] for p in self.poles.tolist()],
            "residues": [[r.real, r.imag] for r in self.residues.tolist()],
        }

    @classmethod
    def from_dict(cls, data: Any, sample_rate_hz: float) -> KnownInput:
        """Raises InputError where `data` is not what `to_dict` writes."""
        try:
            if data["way"] not in (TORQUE, READING):
                raise ValueError(f"way {data['way']!r}")
            poles, residues = (
                np.array([complex(*pair) for pair in data.get(key, [])], dtype=np.complex128)
                for key in ("poles", "residues")
            )
            found = cls(
                str(data["column"]), data["way"], float(data["gain"]), float(data["delay_samples"]),
                float(data["frequency_hz"]) / sample_rate_hz, str(data.get("unit", "")), poles, residues,
            )  # fmt: skip
            if len(poles) != len(residues) or len(poles) > MOST_POLES or np.any(np.abs(poles) >= 1):
                raise ValueError("poles and residues")
            numbers = np.concatenate([[found.gain, found.delay_samples, found.cycles], np.abs(residues)])
            if not np.isfinite(numbers).all() or np.abs(numbers).max() > LARGEST_NUMBER:
                raise ValueError("a number that is not finite, or too large")
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                f"known: is not what identify writes ({error}); remove it, or identify again"
            ) from None
        return found


MOST_POLES, LARGEST_NUMBER = 200, 1e12
"""That a file may hold."""
