"""Records of the small axis that swing through its dead zone, and what was sampled from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from simulated_records import coloured_noise

from bayes_hw.identifiability.structure import rich_command
from bayes_hw.infer import pilot
from bayes_hw.model.excitation import balancing_offset
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units


def swinging(
    model: HammersteinWiener, seed: int, *, share: float = 1.0, start: float = 0.0, gain_negative: float = 1.0
) -> Record:
    """Mirrored steps of `share` times the heights of `rich_command`, balanced so that the axis does not
    drift, from w = `start`; the measured axis has c3 = `gain_negative`."""
    rng = np.random.default_rng(seed)
    u = share * rich_command(model, rng)
    u += balancing_offset(u, model.saturation)
    true = replace(model, dead_zone=replace(model.dead_zone, gain_negative=gain_negative))
    y = true.simulate(u, start).y + coloured_noise(len(u), model.noise_sigma, 0.5, rng)
    return Record(f"swinging_{seed}", np.arange(len(u)) / model.sample_rate_hz, u, y, 20.0, Units())


@pytest.fixture(scope="session", autouse=True)
def _short_pilot() -> Iterator[None]:
    """Sampling's pilot in a third of its steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pilot, "PILOT_STEPS", 30)
        patch.setattr(pilot, "TRIAL_PROPOSALS", 512)
        yield


@pytest.fixture(scope="session")
def swinging_record(small_axis: HammersteinWiener) -> Record:
    """1152 samples that pass both limits and both sides of the dead zone."""
    return swinging(small_axis, 3)
