"""What a fit leaves: how well its variance is known, and whether it is the same at all times."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from bayes_hw.gap.joint.noise_causes import NoiseSpectrum
from bayes_hw.gap.joint.noise_rhythm import rhythm_nats
from bayes_hw.gap.joint.remainder import Remainder, samples_of_variance


def test_the_variance_of_coloured_noise_is_known_worse() -> None:
    """As the spread of the variance over many records says."""
    rng = np.random.default_rng(1)
    records = lfilter([1.0], [1.0, -0.7], rng.standard_normal((400, 2000)), axis=1)[:, 500:]
    spread = np.std(np.mean(records**2, axis=1)) / np.mean(records**2)
    assert abs(np.sqrt(2 / samples_of_variance(list(records[:5]))) * np.sqrt(5) / spread - 1) < 0.15
    white = samples_of_variance([rng.standard_normal(1500)])
    assert 1300 < white <= 1500


def test_a_rhythm_is_told_from_even_noise_and_from_a_burst() -> None:
    rng = np.random.default_rng(2)
    even = [rng.standard_normal(2000) for _ in range(2)]
    assert rhythm_nats(even) < 10
    burst = [e.copy() for e in even]
    burst[0][300:400] *= 3
    assert rhythm_nats(burst) < 20
    heavy = [rng.standard_t(2.5, 2000) for _ in range(20)]
    assert max(rhythm_nats([e]) for e in heavy) < 20
    beat = [e.copy() for e in even]
    for e in beat:
        e[::5] *= 1.5
    assert rhythm_nats(beat) > 30


def test_slow_noise_has_nats_over_an_autoregression() -> None:
    """The better of both causes, over the better of both plain models, and none where it is worse."""

    def slow(spectrum: NoiseSpectrum) -> float:
        return Remainder(12, 2.0, 0.0, spectrum).slow_nats

    assert slow(NoiseSpectrum(0.0, 900.0, 700.0, 930.0, 960.0, 0.1)) == 60.0
    assert slow(NoiseSpectrum(0.0, 700.0, 900.0, 930.0, 910.0, 0.1)) == 30.0
    assert slow(NoiseSpectrum(0.0, 700.0, 900.0, 830.0, 810.0, 0.1)) == 0.0
