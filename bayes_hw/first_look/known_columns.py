"""Further measured columns beside the error: at which frequencies the error follows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.record import Record

SEGMENTS = 16
"""Half overlapping, of the longest record: what coherence is averaged over at least."""

LONGEST, SHORTEST = 4096, 16
EFFECTIVE = 9 / 11
"""Of half-overlapping Hann windows, how many count as independent (Welch 1967,
doi 10.1109/TAU.1967.1161901)."""

LEVEL = 0.01
"""Probability that the largest coherence of a column that has nothing to do with the error exceeds
`bound`."""


@dataclass(frozen=True, eq=False)
class KnownColumn:
    """One column: its coherence with the error over `frequency_hz`, what both owe to the command taken out,
    the `bound` below which it means nothing, and the share of the error's power, in the band shown, that
    follows it."""

    name: str
    unit: str
    frequency_hz: FloatArray
    coherence: FloatArray
    bound: float
    share: float

    @property
    def follows(self) -> bool:
        """Whether the error follows the column at some frequency."""
        return bool(self.coherence.max() > self.bound)

    @property
    def strongest_hz(self) -> float:
        """The frequency of the largest coherence."""
        return float(self.frequency_hz[int(np.argmax(self.coherence))])


def known_columns(
    records: Sequence[Record], errors: Sequence[FloatArray], commands: Sequence[FloatArray], rate: float
) -> tuple[KnownColumn, ...]:
    """Every column that all records have and that changes; `errors` and `commands`, as the axis takes them,
    (samples,) a record each.

    Partial magnitude-squared coherence given the command, by Welch's method over all records: what an error
    holds of the command hides what it holds besides. All are differenced, so that a slow drift common to
    most signals is no coherence.
    """
    return tuple(
        _known_column(name, records, errors, commands, rate)
        for name in records[0].known
        if all(name in record.known and float(np.ptp(record.known[name])) > 0 for record in records)
    )


def _known_column(
    name: str,
    records: Sequence[Record],
    errors: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    rate: float,
) -> KnownColumn:
    from scipy import signal  # takes a second to import, which a record without known columns need not wait

    longest = max(len(record) for record in records)
    length = int(np.clip(2 * longest // (SEGMENTS + 1), SHORTEST, LONGEST))
    spectra = np.zeros((3, 3, length // 2 + 1), dtype=np.complex128)
    segments = 0
    for record, error, command in zip(records, errors, commands, strict=True):
        if len(record) <= length:
            continue
        signals = np.diff([command, record.known[name], error])
        count = (signals.shape[1] - length // 2) // (length - length // 2)
        spectra += count * signal.csd(signals[:, None], signals[None, :], rate, nperseg=length)[1]
        segments += count
    frequency: FloatArray = np.arange(1, length // 2 + 1) * rate / length
    cross, of_column, power = _beside_first(spectra[..., 1:])
    coherence = np.abs(cross) ** 2 / np.maximum(power * of_column, 1e-300)
    independent = max(EFFECTIVE * segments - 1, 2.0)
    each = 1 - (1 - LEVEL) ** (1 / len(coherence))
    bound = 1 - each ** (1 / (independent - 1))
    unmixed = power / (2 * np.sin(np.pi * frequency / rate)) ** 2
    excess = np.clip((coherence * independent - 1) / (independent - 1), 0.0, 1.0)
    share = float(np.sum(excess * unmixed) / max(float(np.sum(unmixed)), 1e-300))
    unit = records[0].known_units.get(name, "")
    return KnownColumn(name, unit, frequency, np.clip(coherence, 0.0, 1.0), float(bound), share)


def _beside_first(spectra: ComplexArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Cross spectrum and both spectra of the second and third of three signals, without what each owes to the
    first; `spectra` (3, 3, frequencies) hold those of every two."""
    first = np.maximum(spectra[0, 0].real, 1e-300)
    own = [spectra[k, k].real - np.abs(spectra[0, k]) ** 2 / first for k in (1, 2)]
    return spectra[1, 2] - spectra[1, 0] * spectra[0, 2] / first, own[0], own[1]
