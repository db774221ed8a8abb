"""Long records: structure sought at a lower rate where the axis is slow, then fitted to every sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.experiment import Experiment, moving_samples
from bayes_hw.identify.growth.delay import at_delay
from bayes_hw.identify.growth.rate_change import at_higher_rate
from bayes_hw.identify.growth.search import Grown, likeliest
from bayes_hw.record import Record

SEARCH_SAMPLES = 40_000
"""Samples of all records together from which on a lower rate is looked for."""

RATE_OVER_HIGHEST = 4.0
"""Of a lower rate over the highest frequency at which output and command are coherent."""

COHERENT = 0.3
SEGMENT = 2048
SCAN_STEPS = 6


def search_factor(experiment: Experiment) -> int:
    """By how much the rate is lowered for the search: 1 where the records are short or the axis is fast."""
    wanted = experiment.samples // SEARCH_SAMPLES
    if wanted <= 1:
        return 1
    allowed = experiment.sample_rate_hz / (RATE_OVER_HIGHEST * _highest_coherent(experiment))
    return max(1, min(wanted, int(allowed)))


def _highest_coherent(experiment: Experiment) -> float:
    """The highest frequency, in Hz, at which the output's increments follow the command."""
    rate = experiment.sample_rate_hz
    found = rate / SEGMENT
    for record in experiment.records:
        frequency, coherence = signal.coherence(
            record.u, np.diff(record.y, prepend=record.y[:1]), rate, nperseg=min(SEGMENT, len(record) // 4)
        )
        above = np.flatnonzero(signal.medfilt(coherence, 5) > COHERENT)
        if above.size:
            found = max(found, float(frequency[above[-1]]))
    return found


def shortened(experiment: Experiment, factor: int) -> Experiment:
    """The records at a rate lower by `factor` (commands averaged over each longer interval, outputs taken at
    its start), and where they are still too long their beginnings, in proportion."""
    share = min(1.0, SEARCH_SAMPLES * factor / experiment.samples)
    records = tuple(_lowered(_beginning(record, share), factor) for record in experiment.records)
    return replace(experiment, records=records, moving=moving_samples(records, experiment.noise_level))


def beginnings(experiment: Experiment) -> Experiment:
    """The same share of each record from its start, SEARCH_SAMPLES in all at most."""
    return shortened(experiment, 1)


def at_full_rate(found: Grown, experiment: Experiment, factor: int) -> Grown:
    """The cascade found at a rate lower by `factor`, fitted to every sample of `experiment`.

    Each component keeps its step response; the delay is sought again about `factor` times that found, on the
    beginnings of the records, and refined on all of them.
    """
    if factor == 1 and found.point.samples == experiment.samples:
        return found
    begun = beginnings(experiment).records
    if factor > 1:
        structure, values = at_higher_rate(found.structure, found.values, factor, len(begun))
        part = with_best_delay(Grown.at(structure, values, begun).descended(), factor)
    else:
        part = Grown.at(found.structure, found.values, begun)
    return Grown.at(part.structure, part.values, experiment.records).descended()


def with_best_delay(start: Grown, reach: int) -> Grown:
    """`start` at the likeliest delay, from strides of half the `reach` down to one sample."""
    best, stride = start, max(1, reach // 2)
    while True:
        here = best.structure.delay_samples
        near = [at_delay(best, d).descended(SCAN_STEPS) for d in (here - stride, here + stride) if d >= 0]
        likely = likeliest([best, *near])
        if likely is not best:
            best = likely.descended()
        elif stride == 1:
            return best
        else:
            stride //= 2


def _beginning(record: Record, share: float) -> Record:
    return record if share >= 1 else record.split(share)[0]


def _lowered(record: Record, factor: int) -> Record:
    if factor == 1:
        return record
    whole = len(record) // factor * factor
    blocks: FloatArray = record.u[:whole].reshape(-1, factor).mean(axis=1)
    return replace(
        record,
        t=record.t[:whole:factor],
        u=blocks,
        y=record.y[:whole:factor],
        sample_rate_hz=record.sample_rate_hz / factor,
        measured=None if record.measured is None else record.measured[:whole:factor],
        known={name: values[:whole:factor] for name, values in record.known.items()},
    )
