"""What noise that is said to have a cause knows of the command.

A drive that gets hot lowers its limits, a supply sags, a converter follows its source with play, or later
than the limits it goes into. What these leave is slow and follows no angle, and noise that moves the axis is
close to it; but neither wind nor an angle that walks knows anything of what is commanded.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.noise_screen import NoiseScreen
from bayes_hw.gap.joint.response.effect_paths import limited_and_gain, through_drive

INSTANTS = tuple(np.arange(0.05, 0.951, 0.05))
"""Shares of a record at which something may change and stay so."""


def command_nats(fit: JointFit) -> float:
    """Nats that what promises most promises under the fit's noise: limits that change at an instant of every
    record, its own; a gain that does; or, of all records, play of the command or a delay that limits do not
    have. Less the price of what was tried."""
    screen = NoiseScreen.of(fit, fit.point.whitener)
    responses = [_responses(fit, number) for number in range(len(fit.response.records))]
    changed = [0.0, 0.0]
    for number, (limits, gain, *_) in enumerate(responses):
        for kind, rows in enumerate((limits, gain)):
            promised = _promised(fit, screen, number, rows)
            changed[kind] += max(max(promised) - float(np.log(len(rows))), 0.0)
    of_all = zip(*(own for _, _, *own in responses), strict=True)
    return max(*changed, *(screen.gain(rows) for rows in of_all))


def limits_that_change(fit: JointFit, screen: NoiseScreen) -> tuple[float, tuple[int, ...]]:
    """Nats that limits which change at a sample of every record promise under one noise; those samples."""
    promised, instants = 0.0, []
    for number, record in enumerate(fit.response.records):
        gains = _promised(fit, screen, number, _responses(fit, number)[0])
        best = int(np.argmax(gains))
        promised += max(gains[best] - float(np.log(len(gains))), 0.0)
        instants.append(round(INSTANTS[best] * len(record)))
    return promised, tuple(instants)


def _promised(fit: JointFit, screen: NoiseScreen, number: int, rows: FloatArray) -> list[float]:
    """Nats of every row (rows, samples) of one record."""
    found = []
    for row in rows:
        tangents = [np.zeros((1, len(r))) for r in fit.response.records]
        tangents[number] = row[None]
        found.append(screen.gain(tangents))
    return found


def last_direction(command: FloatArray) -> FloatArray:
    """The sign of the last change (samples,) of a command that begins at zero; zero before the first."""
    change = np.sign(np.diff(command, prepend=0.0))
    changed = np.where(change != 0, np.arange(len(change)), 0)
    return np.asarray(change[np.maximum.accumulate(changed)], dtype=np.float64)


def _responses(fit: JointFit, number: int) -> list[FloatArray]:
    """Derivatives of one record's weighted output: by the logarithm of both limits from every instant on
    (instants, samples), by that of the command's gain likewise, by half of its play (1, samples), and by
    samples that the command comes sooner where it is at its limits (1, samples)."""
    values, record = fit.values, fit.response.records[number]
    run = fit.response.along(values, number)
    late = fit.structure.delay_samples
    asked = np.concatenate([np.zeros(late), record.u[: len(record) - late]])
    limited, gain = limited_and_gain(fit.response.packed(values), asked, run.w)
    within = limited == asked
    later = (np.arange(len(record)) >= len(record) * np.array(INSTANTS)[:, None]).astype(np.float64)
    weights = fit.response.weights
    slope = run.slope if weights is None else run.slope / weights[number]
    rows: tuple[FloatArray, ...] = (
        later * np.where(within, 0.0, limited * gain),
        later * run.v,
        np.where(within, -last_direction(asked) * gain, 0.0)[None],
        np.where(within, 0.0, np.diff(limited, prepend=0.0) * gain)[None],
    )
    return [through_drive(fit.structure, values, row) * slope for row in rows]
