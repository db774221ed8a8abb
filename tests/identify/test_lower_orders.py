"""A lower order whose descent ended short of its minimum is tried again without blocks not shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.identify import joint_output_error
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_fit import CascadeFit, evaluated, fit_cascade
from bayes_hw.identify.four_steps import identify
from bayes_hw.record import Record, Units

RATE_HZ, SAMPLES = 10.0, 430


def first_order_record() -> Record:
    """An integrator with one lag, far from zero, moved by a command that never turns."""
    rng = np.random.default_rng(4)
    t = np.arange(SAMPLES) / RATE_HZ
    u = 0.1 * np.clip(np.minimum(t - 3, 40 - t), 0, 1)
    lagged = np.zeros(SAMPLES)
    for k in range(1, SAMPLES):
        lagged[k] = 0.55 * lagged[k - 1] + 0.45 * u[k - 1]
    noise = np.zeros(SAMPLES)
    for k in range(1, SAMPLES):
        noise[k] = 0.5 * noise[k - 1] + 4e-5 * rng.standard_normal()
    y = -28.7 + np.cumsum(lagged) / RATE_HZ + noise
    return Record("lag", t, u, y, RATE_HZ, Units("s", "deg/s", "deg"))


def test_an_order_whose_descent_crept_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """With blocks free that the record does not show, descents of order 2 stop where they start."""

    def creeping(
        structure: Structure, start: CascadeValues, records: Sequence[Record], **more: int
    ) -> CascadeFit:
        if structure.order == 2 and (structure.upper or structure.dead_zone):
            shaken = replace(start, integrator_residue=start.integrator_residue * 1.001)
            return evaluated(structure, shaken, records)
        return fit_cascade(structure, start, records, **more)

    monkeypatch.setattr(joint_output_error, "fit_cascade", creeping)
    found = identify([first_order_record()], rng=np.random.default_rng(1), free_start=True)
    assert len(found.model.linear.poles) == 2
    assert min(found.orders, key=lambda candidate: candidate.criterion).order == 2


def test_every_structure_is_in_the_table_once() -> None:
    found = identify([first_order_record()], rng=np.random.default_rng(1), free_start=True)
    structures = [(c.order, c.delay_samples, c.integrator) for c in found.orders]
    assert len(structures) == len(set(structures))
