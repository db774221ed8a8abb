"""Long records: structure sought at a lower rate where the axis is slow, then fitted to every sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import signal

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.experiment import Experiment, moving_samples
from bayes_hw.identify.growth.delay import at_better_delay, at_longest_delay
from bayes_hw.identify.growth.extension import pair_of, section_of, with_single_poles, without_real_pole
from bayes_hw.identify.growth.lowered import lowered
from bayes_hw.identify.growth.search import Grown
from bayes_hw.identify.growth.slow_poles import slow_time_constants, with_real_poles
from bayes_hw.identify.growth.without_zeros import without_zeros
from bayes_hw.identify.noise import MAX_ORDER
from bayes_hw.record import Record

FASTEST = 0.02
"""A pole at or below this value at the lower rate, which no continuous-time mode gives, is taken for it: the
axis has settled within a sample."""


def at_higher_rate(
    structure: Structure, values: CascadeValues, factor: int, records: int
) -> tuple[Structure, CascadeValues]:
    """The cascade for a rate `factor` times as high, with starts (records, order) of zero.

    For a command held over each sample, a pole p of residue r is a mode whose step response at the samples is
    r (1 - p^k) / (1 - p): at the higher rate its pole is p^(1 / factor) and its residue
    r (1 - p^(1 / factor)) / (1 - p) (Ljung, System Identification, sec. 4.5). The delay is `factor` times as
    many samples.
    """
    poles, residues = _faster(values.real[0].astype(complex), values.real[1].astype(complex), factor)
    sections = np.empty_like(values.sections)
    for number, section in enumerate(values.sections.T):
        sections[:, number] = section_of(*_faster(*pair_of(section), factor))
    moved = replace(structure, delay_samples=structure.delay_samples * factor)
    real: FloatArray = np.stack([poles.real, residues.real])
    return moved, replace(
        values,
        integrator_residue=values.integrator_residue / factor,
        real=real,
        sections=sections,
        starts=np.zeros((records, structure.order)),
    )


def _faster(poles: ComplexArray, residues: ComplexArray, factor: int) -> tuple[ComplexArray, ComplexArray]:
    steady = residues / (1 - poles)
    possible = np.where((poles.imag == 0) & (poles.real < FASTEST), FASTEST, poles)
    roots = possible ** (1 / factor)
    return np.asarray(roots, np.complex128), np.asarray(steady * (1 - roots), np.complex128)


LONG_SAMPLES = 40_000
"""Samples of all records together from which on structure is sought on fewer."""

SEARCH_SAMPLES = 24_000
"""So many, at a lower rate where the axis is slow."""

DELAY_SAMPLES = 240_000
"""Of the beginnings at the full rate, for the delay."""

BASELINE_SAMPLES = 12_000
"""Of the beginnings, for the linear baseline and the first steps."""

RATE_OVER_HIGHEST = 4.0
"""Of a lower rate over the highest frequency at which output and command are coherent."""

COHERENT = 0.3
SEGMENT = 2048


def search_factor(experiment: Experiment) -> int:
    """By how much the rate is lowered for the search: 1 where the records are short or the axis is fast."""
    if experiment.samples <= LONG_SAMPLES:
        return 1
    return min(experiment.samples // SEARCH_SAMPLES, slow_factor(experiment.records))


def slow_factor(records: Sequence[Record]) -> int:
    """By how much the rate may be lowered for a slow axis, 1 or more."""
    return max(1, int(records[0].sample_rate_hz / (RATE_OVER_HIGHEST * _highest_coherent(records))))


def _highest_coherent(records: Sequence[Record]) -> float:
    """The highest frequency, in Hz, at which the output's increments follow the command."""
    rate = records[0].sample_rate_hz
    found = rate / SEGMENT
    for record in records:
        frequency, coherence = signal.coherence(
            record.u, np.diff(record.y, prepend=record.y[:1]), rate, nperseg=min(SEGMENT, len(record) // 4)
        )
        above = np.flatnonzero(signal.medfilt(coherence, 5) > COHERENT)
        if above.size:
            found = max(found, float(frequency[above[-1]]))
    return found


def for_search(experiment: Experiment, factor: int) -> Experiment:
    """Long records at a rate lower by `factor` (see `lowered`), and where they are still too long their
    beginnings, in proportion."""
    if experiment.samples <= LONG_SAMPLES:
        return experiment
    share = min(1.0, SEARCH_SAMPLES * factor / experiment.samples)
    return _of_records(
        experiment, [lowered(_beginning(record, share), factor) for record in experiment.records]
    )


def beginnings(experiment: Experiment) -> Experiment:
    """Of long records the same share of each from its start, BASELINE_SAMPLES in all."""
    if experiment.samples <= LONG_SAMPLES:
        return experiment
    share = BASELINE_SAMPLES / experiment.samples
    return _of_records(experiment, [_beginning(record, share) for record in experiment.records])


def _of_records(experiment: Experiment, records: Sequence[Record]) -> Experiment:
    return replace(
        experiment, records=tuple(records), moving=moving_samples(tuple(records), experiment.noise_level)
    )


def at_full_rate(found: Grown, experiment: Experiment, factor: int) -> Grown:
    """The cascade found at a rate lower by `factor`, fitted to every sample of `experiment`.

    Each component keeps its step response, and strongly damped pairs are parted, on the beginnings of the
    records; the delay is sought again about `factor` times that found, on DELAY_SAMPLES, since few samples do
    not tell it from a slow onset, and poles that stood in for it go; then all samples are fitted.
    """
    if factor == 1 and found.point.samples == experiment.samples:
        return with_real_poles(found)
    part = descended_on(found, for_search(experiment, 1).records, factor)
    part = with_real_poles(part)
    if factor > 1:
        share = min(1.0, DELAY_SAMPLES / experiment.samples)
        begun = [_beginning(record, share) for record in experiment.records]
        part = with_own_delay(Grown.at(part.structure, part.values, begun).descended(), factor)
    if part.point.samples == experiment.samples:
        return part.descended()
    return Grown.at(part.structure, part.values, experiment.records).descended()


def descended_on(found: Grown, records: Sequence[Record], factor: int, most_noise: int = MAX_ORDER) -> Grown:
    """The cascade of a rate lower by `factor` fitted to records of the full rate, under noise of orders up to
    `most_noise`."""
    structure, values = found.structure, found.values
    if factor > 1:
        structure, values = at_higher_rate(structure, values, factor, len(records))
    return Grown.at(structure, values, records, most_noise).descended()


def with_own_delay(start: Grown, factor: int) -> Grown:
    """`start` at its delay, without the poles that a rate lower by `factor` asks for: there a delay is a
    multiple of `factor` samples, and poles make up for the rest. Of delays that the records do not tell apart
    it is the one of a G without zeros where there is one, else the longest."""
    best = start
    while True:
        moved = at_better_delay(without_fast_poles(best), factor)
        if moved.structure == best.structure:
            return without_zeros(at_longest_delay(moved))
        best = moved


def without_fast_poles(item: Grown) -> Grown:
    """`item` without the real poles, one at a time, that its criterion does not ask for; slow ones, which are
    kept for what they have in common with a dead zone, stay."""
    records, most_noise = item.response.records, item.point.most_noise
    shortest, _ = slow_time_constants(item)
    while True:
        structure, values = with_single_poles(item.structure, item.values)
        fast = np.flatnonzero(values.real[0] < np.exp(-1 / shortest))
        fewer = [without_real_pole(structure, values, int(number)) for number in fast]
        trials = [Grown.at(*one, records, most_noise).descended() for one in fewer]
        best = min([item, *trials], key=lambda trial: trial.criterion)
        if best is item:
            return item
        item = best


def _beginning(record: Record, share: float) -> Record:
    return record if share >= 1 else record.split(share)[0]
