"""The twin with other seeds of its noise, each from its records alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pages.repeats_section import Repeats
from rank_statistics import IntervalCoverage
from recovery import LEVELS, recover
from true_axis import KnownAxis, TrueNoise
from twin import NOISE_CORRELATION, twin_records

from bayes_hw.infer.sampler import SamplerSettings


def recover_seed(task: Mapping[str, Any]) -> dict[str, Any]:
    """One repeat with the noise of `seed`, sampled for at most `max_steps`; plain data."""
    twin = twin_records(np.random.default_rng(task["seed"]))
    noise = TrueNoise(twin.truth.noise_sigma, (NOISE_CORRELATION,))
    settings = SamplerSettings(max_steps=task["max_steps"])
    rng = np.random.default_rng([task["seed"], 1])
    return recover(KnownAxis(twin.truth, noise, twin.train), rng, settings=settings)


def repeats_of(results: Sequence[Mapping[str, Any]]) -> Repeats:
    """What the repeats say together, by parameter."""
    names = list(dict.fromkeys(name for each in results for name in each["inside"]))
    held = {
        name: [bool(each["inside"][name][-1]) for each in results if name in each["inside"]] for name in names
    }
    widths = {name: [each["width"][name] for each in results if name in each["width"]] for name in names}
    return Repeats(
        repeats=len(results),
        converged=sum(bool(each["converged"]) for each in results),
        held={name: IntervalCoverage(LEVELS[-1], sum(h), len(h)) for name, h in held.items()},
        median_width={name: float(np.median(found)) for name, found in widths.items() if found},
    )
