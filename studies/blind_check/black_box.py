"""A black-box residual model: how much of a gap could be closed at all, by something that names nothing.

The base parameters are re-estimated by least squares; what the simulator leaves on the training records is
regressed on a library of signals that need no measured output (lags of the limited command and of the sign of
the simulated speed, slow weights of time, powers and harmonics of the simulated angle), together with the
tangents of the base parameters, which the missing effect has pushed. The ridge on the library is chosen on
training records left out in turn. Not a diagnosis: its answer is `other` where it helps and none where it
does not. Only for scores to compare with.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import write_csv, write_json
from bayes_hw.gap.blind.counts import CLASSES
from bayes_hw.gap.blind.run import PREDICTION, VERDICT
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.plant.nominal import Nominal, refit
from bayes_hw.record import Record

LAGS = 6
HARMONICS = 4
STICTION_SHARE = 0.05
RIDGES = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0)
TANGENT_RIDGE = 1e-6
TANGENT_STEP = 1e-4
LEAST_GAIN = 0.05
"""Share of the squared residual of records left out that the library must remove to be used."""


def black_box(case: Path, out: Path, seed: int, **options: str) -> None:  # noqa: ARG001
    """Write a verdict in the fixed format for the case; to be named to bayes-hw blind run --diagnosis."""
    begin = time.perf_counter()
    description = json.loads((case / "case.json").read_text(encoding="utf-8"))
    given = nominal_from(HammersteinWiener.read(case / description["model"]))
    train = [Record.read(case / name) for name in description["train"]]
    holdout = Record.read(case / description["holdout"][0])
    base = refit(given, [r.u for r in train], [r.y for r in train])
    residuals = [r.y - base.simulate(r.u) for r in train]
    library, moves = [signals(base, r.u) for r in train], [tangents(base, r.u) for r in train]
    ridge, gain = chosen_ridge(library, moves, residuals)
    before = base.simulate(holdout.u)
    used = gain > LEAST_GAIN
    after = before
    if used:
        weights = _weights(library, moves, residuals, ridge)
        after = before + np.hstack([signals(base, holdout.u), tangents(base, holdout.u)]) @ weights
    spread = float(np.std(np.concatenate(residuals)))
    write_csv(
        out / PREDICTION,
        {
            "t": holdout.t,
            "before": before,
            "after": after,
            "lo": after - 2 * spread,
            "hi": after + 2 * spread,
        },
    )
    write_json(out / VERDICT, _verdict(used, gain, time.perf_counter() - begin), None)


def nominal_from(model: HammersteinWiener) -> Nominal:
    """The simulator's parameters, its dominant modes taken from its poles."""
    chosen = model.mode_indices()
    poles = model.linear.poles
    light = [poles[i] for i in chosen]
    others = [p for p in poles if all(abs(p - q) > 1e-12 and abs(p - q.conjugate()) > 1e-12 for q in light)]
    return Nominal(
        model.saturation.lower,
        model.saturation.upper,
        model.dead_zone.half_width,
        model.linear.gain,
        tuple((mode.frequency_hz, mode.damping_ratio) for mode in model.dominant_modes),
        model.linear.zeros,
        np.array(others, dtype=np.complex128),
        model.linear.delay_samples,
        model.sample_rate_hz,
    )


def signals(base: Nominal, command: FloatArray) -> FloatArray:
    """The library for one record, shape (samples, signals): what a simulator can know without the output."""
    samples, step = len(command), 1 / base.sample_rate_hz
    v = np.clip(_late(command, base.delay_samples), base.lower, base.upper)
    y = base.simulate(command)
    speed = np.gradient(y) / step
    typical = max(float(np.std(speed)), 1e-12)
    sign = np.tanh(speed / (STICTION_SHARE * typical))
    t = np.arange(samples) / samples
    early = np.exp(-3 * t)
    columns = [t, t**2, early, np.tanh(speed / typical), np.abs(y), np.sign(y) * y**2]
    columns += [np.cumsum(v * weight) * step for weight in (t, early, np.abs(v))]
    columns += [_late(signal, lag) for signal in (v, sign) for lag in range(LAGS)]
    span = max(float(np.ptp(y)), 1e-9)
    for harmonic in range(1, HARMONICS + 1):
        angle = 2 * np.pi * harmonic * y / span
        columns += [np.sin(angle), np.cos(angle)]
    return np.column_stack(columns)


def tangents(base: Nominal, command: FloatArray) -> FloatArray:
    """Change of y for each base parameter, relative to its value, shape (samples, parameters)."""
    values, y = base.vector(), base.simulate(command)
    steps = 1 + TANGENT_STEP * np.eye(len(values))
    return np.column_stack(
        [(base.with_vector(values * step).simulate(command) - y) / TANGENT_STEP for step in steps]
    )


def chosen_ridge(
    library: Sequence[FloatArray], moves: Sequence[FloatArray], residuals: Sequence[FloatArray]
) -> tuple[float, float]:
    """The ridge that predicts training records left out in turn best, and the share of their squared residual
    that it removes; without a second record nothing can be left out and nothing is removed."""
    if len(residuals) < 2:
        return RIDGES[-1], 0.0
    removed = {}
    for ridge in RIDGES:
        left = 0.0
        for out in range(len(residuals)):
            kept = [i for i in range(len(residuals)) if i != out]
            weights = _weights(
                [library[i] for i in kept], [moves[i] for i in kept], [residuals[i] for i in kept], ridge
            )
            prediction = np.hstack([library[out], moves[out]]) @ weights
            left += float(np.sum((residuals[out] - prediction) ** 2))
        removed[ridge] = 1 - left / max(float(np.sum(np.concatenate(residuals) ** 2)), 1e-300)
    best = max(removed, key=lambda ridge: removed[ridge])
    return best, removed[best]


def _weights(
    library: Sequence[FloatArray], moves: Sequence[FloatArray], residuals: Sequence[FloatArray], ridge: float
) -> FloatArray:
    """Weights of library and tangents in least squares, the library's with a ridge."""
    free, base = np.concatenate(library), np.concatenate(moves)
    matrix, target = np.hstack([free, base]), np.concatenate(residuals)
    scale = np.maximum(np.std(matrix, axis=0), 1e-12)
    scaled = matrix / scale
    penalty = np.concatenate([np.full(free.shape[1], ridge), np.full(base.shape[1], TANGENT_RIDGE)])
    normal = scaled.T @ scaled / len(target) + np.diag(penalty)
    return np.asarray(np.linalg.solve(normal, scaled.T @ target / len(target)) / scale, dtype=np.float64)


def _late(values: FloatArray, lag: int) -> FloatArray:
    return np.concatenate([np.zeros(lag), values])[: len(values)]


def _verdict(used: bool, gain: float, seconds: float) -> dict[str, object]:
    closed = {
        "rmse_before": None, "rmse_after": None, "noise_floor": None, "closed": max(gain, 0.0),
        "closed_hdi94": [None, None],
    }  # fmt: skip
    said = "other" if used else "none"
    return {
        "schema": "bayes-hw/verdict/1",
        "answer": ["other"] if used else [],
        "probability": {name: float(name == said) for name in CLASSES},
        "confusable": [],
        "where": {"block": "", "band_hz": [0.0, 0.0], "regime": "", "share": {}},
        "gap": {"train": closed, "holdout": closed},
        "parameters": {},
        "base": {},
        "next_experiment": None,
        "seconds": seconds,
    }
