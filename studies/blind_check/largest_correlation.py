"""The plain textbook diagnosis: whose signature does the residual correlate with most?

The base parameters are re-estimated by least squares; from the residual of the training records and from the
signature of every effect (the change that it makes in the simulated output to first order, over a grid of
shapes) the tangents of the base parameters are projected off; the effect whose signature explains the largest
share of the residual is named. White noise is assumed, and wind, rounding, jitter and glitches, which have no
signature in the commands, cannot be named. A baseline for scores to compare with.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.files import write_csv, write_json
from bayes_hw.gap.blind.counts import CLASSES
from bayes_hw.gap.blind.run import PREDICTION, VERDICT
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.plant.nominal import Nominal, refit
from bayes_hw.record import Record
from blind_check.black_box import nominal_from, tangents

LEAST_SHARE = 0.02
"""Share of the squared residual below which nothing is named."""

PERIODS = np.exp(np.linspace(np.log(0.02), np.log(1.5), 40))
"""Of effects periodic in the angle, as shares of its range."""

WIDE_OPEN = 1e9


def largest_correlation(case: Path, out: Path, seed: int, **options: str) -> None:  # noqa: ARG001
    """Write a verdict in the fixed format for the case; to be named to bayes-hw blind run --diagnosis."""
    begin = time.perf_counter()
    description = json.loads((case / "case.json").read_text(encoding="utf-8"))
    given = nominal_from(HammersteinWiener.read(case / description["model"]))
    train = [Record.read(case / name) for name in description["train"]]
    holdout = Record.read(case / description["holdout"][0])
    base = refit(given, [r.u for r in train], [r.y for r in train])
    residual = np.concatenate([r.y - base.simulate(r.u) for r in train])
    moves = np.concatenate([tangents(base, r.u) for r in train])
    basis, _ = np.linalg.qr(moves / np.maximum(np.linalg.norm(moves, axis=0), 1e-12))
    span = max(float(np.ptp(base.simulate(r.u))) for r in train)
    shares: dict[str, tuple[float, int]] = {}
    for number, (label, columns) in enumerate(stacked([r.u for r in train], base, span)):
        share = explained(columns, basis, residual)
        if share > shares.get(label, (0.0, 0))[0]:
            shares[label] = (share, number)
    best = max(shares, key=lambda label: shares[label][0])
    named = shares[best][0] > LEAST_SHARE
    before = base.simulate(holdout.u)
    after = before
    if named:
        columns = [c for _, c in stacked([r.u for r in train], base, span)][shares[best][1]]
        ahead = [c for _, c in stacked([holdout.u], base, span)][shares[best][1]]
        weights = np.linalg.lstsq(np.hstack([columns, moves]), residual, rcond=None)[0]
        after = before + np.hstack([ahead, tangents(base, holdout.u)]) @ weights
    spread = 2 * float(np.std(residual))
    write_csv(
        out / PREDICTION,
        {"t": holdout.t, "before": before, "after": after, "lo": after - spread, "hi": after + spread},
    )
    content = _verdict([best] if named else [], shares[best][0], time.perf_counter() - begin)
    write_json(out / VERDICT, content, None)


def explained(columns: FloatArray, basis: FloatArray, residual: FloatArray) -> float:
    """Share of the residual's square that the columns explain beyond the tangents; shapes (samples, ...).

    `basis` is an orthonormal one of the tangents.
    """
    left = residual - basis @ (basis.T @ residual)
    free = columns - basis @ (basis.T @ columns)
    norms = np.linalg.norm(free, axis=0)
    free = free[:, norms > 1e-9 * max(float(np.linalg.norm(columns)), 1e-300)]
    if free.shape[1] == 0:
        return 0.0
    own, _ = np.linalg.qr(free)
    return float(np.sum((own.T @ left) ** 2) / max(float(np.sum(left**2)), 1e-300))


def stacked(commands: list[FloatArray], base: Nominal, span: float) -> Iterator[tuple[str, FloatArray]]:
    """Label and columns of every signature, the records one below the other, always in the same order."""
    for parts in zip(*(signatures(base, u, span) for u in commands), strict=True):
        yield parts[0][0], np.concatenate([columns for _, columns in parts])


def signatures(base: Nominal, command: FloatArray, span: float) -> Iterator[tuple[str, FloatArray]]:
    """Label and columns, shape (samples, k), of every shape of every effect, for one record."""
    delayed = np.concatenate([np.zeros(base.delay_samples), command])[: len(command)]
    v = np.clip(delayed, base.lower, base.upper)
    linear = replace(base, lower=-WIDE_OPEN, upper=WIDE_OPEN, half_width=0.0, delay_samples=0)
    w, y, step = linear.simulate(v), base.simulate(command), 1 / base.sample_rate_hz
    shown = (np.abs(w) > base.half_width).astype(np.float64)
    t = np.arange(len(v)) / len(v)
    speed = np.gradient(w) / step
    sign = np.tanh(speed / max(0.03 * float(np.std(speed)), 1e-12))
    force = np.gradient(speed) / step

    yield "command_bias", (shown * linear.simulate(np.ones(len(v))))[:, None]
    for share in (0.15, 0.4, 1.0):
        warm = 1 - np.exp(-t / share)
        yield "gain_drift", (shown * linear.simulate(v * warm))[:, None]
        yield "sensor_drift", np.column_stack([t, warm])
    limit = max(base.upper, -base.lower)
    for rate in (3.0, 10.0, 30.0):
        yield "rate_limit", (shown * (linear.simulate(_ramped(v, rate * limit * step)) - w))[:, None]
    for late in (1, 2):
        yield "transport_delay", (np.concatenate([np.zeros(late), y])[: len(y)] - y)[:, None]
    yield "gain_asymmetry", np.minimum(w + base.half_width, 0.0)[:, None]
    for hz in np.exp(np.linspace(np.log(0.4), np.log(min(8.0, 0.4 * base.sample_rate_hz)), 24)):
        yield "unmodelled_mode", shown[:, None] * _resonance(force, float(hz), 0.02, step)
    twist = _resonance(force, base.modes[0][0] if base.modes else 2.0, 0.1, step)[:, 0]
    yield "cubic_stiffness", shown[:, None] * _resonance(twist**3, 2.0, 0.5, step)
    leaky = [np.asarray(signal.lfilter([1 - a], [1, -a], sign)) for a in (0.5, 0.9, 0.98)]
    yield "friction", shown[:, None] * np.column_stack([sign, *leaky])
    for half_gap in (0.003, 0.01, 0.03):
        yield "backlash", (shown * (_play(w, half_gap * span) - w))[:, None]
    for period in PERIODS * span:
        wave = np.column_stack([np.sin(2 * np.pi * w / period), np.cos(2 * np.pi * w / period)])
        yield "encoder_eccentricity", wave
        yield "torque_ripple", shown[:, None] * np.asarray(signal.lfilter([0.1], [1, -0.9], wave, axis=0))
        if period > 0.1 * span:
            moved = [linear.simulate(v * np.where(v != delayed, 0.1 * s, 0.0)) for s in wave.T]
            yield "saturation_drift", shown[:, None] * np.column_stack(moved)


def _ramped(v: FloatArray, largest: float) -> FloatArray:
    out, level = np.empty_like(v), 0.0
    for k, target in enumerate(v.tolist()):
        level += min(max(target - level, -largest), largest)
        out[k] = level
    return out


def _play(w: FloatArray, half_gap: float) -> FloatArray:
    out, level = np.empty_like(w), 0.0
    for k, angle in enumerate(w.tolist()):
        level = min(max(level, angle - half_gap), angle + half_gap)
        out[k] = level
    return out


def _resonance(force: FloatArray, hz: float, damping: float, step: float) -> FloatArray:
    """Angle and speed of a mass on a spring under the force, shape (samples, 2)."""
    omega = 2 * np.pi * hz * step
    pole = np.exp(omega * complex(-damping, np.sqrt(1 - damping**2)))
    angle = np.asarray(signal.lfilter([0.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force))
    return np.column_stack([angle, np.gradient(angle)])


def _verdict(answer: list[str], share: float, seconds: float) -> dict[str, object]:
    gap = {
        "rmse_before": None,
        "rmse_after": None,
        "noise_floor": None,
        "closed": share,
        "closed_hdi94": [None, None],
    }
    said = answer or ["none"]
    return {
        "schema": "bayes-hw/verdict/1",
        "answer": answer,
        "probability": {name: float(name in said) for name in CLASSES},
        "confusable": [],
        "where": {"block": LABEL_BLOCKS.get(said[0], ""), "band_hz": [0.0, 0.0], "regime": "", "share": {}},
        "gap": {"train": gap, "holdout": gap},
        "parameters": {},
        "base": {},
        "next_experiment": None,
        "seconds": seconds,
    }
