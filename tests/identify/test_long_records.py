"""Records at a lower rate, for the search of long ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from known_axis import commands, known_axis, simulated_records

from bayes_hw.identify.experiment import prepare
from bayes_hw.identify.long_records import shortened


def test_a_lower_rate_averages_commands_and_keeps_what_was_not_measured() -> None:
    rng = np.random.default_rng(1)
    (record,) = simulated_records(known_axis(), commands(rng, 1, 0.3), rng, 0.01)
    measured = np.arange(len(record)) % 5 != 0
    held = replace(record, measured=measured, known={"wind": 2 * record.y})
    experiment = prepare([held], free_start=False)
    (scaled,) = experiment.records
    (found,) = shortened(experiment, 3).records
    assert found.sample_rate_hz == record.sample_rate_hz / 3
    assert len(found) == len(found.known["wind"]) == len(record) // 3
    np.testing.assert_allclose(found.u, scaled.u.reshape(-1, 3).mean(axis=1))
    np.testing.assert_array_equal(found.y[measured[::3]], scaled.y[::3][measured[::3]])
    np.testing.assert_array_equal(found.known["wind"], held.known["wind"][::3])
    np.testing.assert_array_equal(found.measured_samples, measured[::3])
