"""A known axis under steps of random height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from true_axis import KnownAxis, TrueNoise

from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def stepped_axis(model: HammersteinWiener, noise: TrueNoise, seed: int = 1) -> KnownAxis:
    """`model` with two records of held random steps, the same for every seed but for their noise."""
    command_rng, rng = np.random.default_rng(1), np.random.default_rng(seed)
    rate = model.sample_rate_hz
    records = []
    for number in range(2):
        u = np.repeat(command_rng.normal(0, 0.9, size=60), 10)
        y = model.simulate(u).y + noise.sequence(len(u), rng)
        records.append(Record(f"r{number}", np.arange(len(u)) / rate, u, y, rate, model.units))
    return KnownAxis(replace(model, noise_sigma=noise.sigma), noise, tuple(records))
