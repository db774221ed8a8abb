"""Long records: structure sought at a lower rate where the axis is slow, then fitted to every sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_roots import poles_of, with_poles
from bayes_hw.identify.experiment import Experiment, moving_samples
from bayes_hw.identify.growth.delay import at_delay
from bayes_hw.identify.growth.search import Grown, likeliest
from bayes_hw.record import Record

SEARCH_SAMPLES = 40_000
"""Samples of all records together from which on a lower rate is looked for."""

RATE_OVER_HIGHEST = 4.0
"""Of a lower rate over the highest frequency at which output and command are coherent."""

COHERENT = 0.3
SEGMENT = 2048
SCAN_STEPS = 2


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

    Poles are taken to the higher rate as p^(1 / factor); residues follow by the descent, in which the output
    is linear, and the delay by a scan about `factor` times that found.
    """
    if factor == 1 and found.point.samples == experiment.samples:
        return found
    structure, values = _at_rate(found, factor, len(experiment.records))
    start = Grown.at(structure, values, experiment.records).descended(SCAN_STEPS)
    best, stride = start, max(1, factor // 2)
    while True:
        here = best.structure.delay_samples
        near = [at_delay(best, d).descended(SCAN_STEPS) for d in (here - stride, here + stride) if d >= 0]
        likely = likeliest([best, *near])
        if likely is not best:
            best = likely
        elif stride == 1:
            return best.descended()
        else:
            stride //= 2


def _at_rate(found: Grown, factor: int, records: int) -> tuple[Structure, CascadeValues]:
    old, values = found.structure, found.values
    if factor == 1:
        starts = np.zeros((records, old.order))
        return old, replace(values, starts=starts)
    poles = poles_of(values, integrator=False)
    kept = poles[(poles.imag != 0) | (poles.real > 0)]
    roots = kept.astype(complex) ** (1 / factor)
    real = int(np.count_nonzero(roots.imag == 0))
    structure = replace(
        old,
        delay_samples=old.delay_samples * factor,
        real_poles=real % 2,
        sections=(len(roots) - real % 2) // 2,
    )
    moved = with_poles(structure, roots)
    return structure, replace(
        moved,
        lower=values.lower,
        upper=values.upper,
        half_width=values.half_width,
        integrator_residue=values.integrator_residue / factor,
        starts=np.zeros((records, structure.order)),
    )


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
