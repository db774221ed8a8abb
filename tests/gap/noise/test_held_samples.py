"""Repeated samples are found with their share, and not in plain noise."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA
from fitted import SAMPLES, base, noise, of_records, outputs, with_residuals

from bayes_hw.gap.noise.held_samples import held_samples


@pytest.mark.parametrize("share", [0.15, 0.5])
def test_held_samples(share: float) -> None:
    """The share of repeated samples within three of its errors, where the axis moves."""
    rng, measured, displays = np.random.default_rng(7), [], outputs()
    for e, y in zip(noise(), displays, strict=True):
        source = np.arange(SAMPLES)
        for k in range(1, SAMPLES):
            if rng.random() < share:
                source[k] = source[k - 1]
        measured.append(y[source] + e)
    found = held_samples(of_records(measured, base()))
    assert found is not None and found.form == "held samples" and found.display is not None
    estimate, error, _ = found.parameters["timing_jitter.repeated_share"]
    assert abs(estimate - share) < 3 * max(error, 0.02)
    shown = [found.display.show(y, r) for r, y in enumerate(displays)]
    left = np.concatenate([y - s for y, s in zip(measured, shown, strict=True)])
    assert left.std() < 1.25 * SIGMA
    assert left.std() < 0.8 * np.concatenate([m - y for m, y in zip(measured, displays, strict=True)]).std()


def test_nothing_is_held_in_plain_noise() -> None:
    found = held_samples(with_residuals(noise()))
    assert found is None or found.parameters["timing_jitter.repeated_share"][0] < 0.1
