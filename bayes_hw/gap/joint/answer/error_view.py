"""What convinces of an effect that no law of the axis makes: the error over time, speed or frequency, by the
number of a sample, or where within a step readings lie."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from bayes_hw.arrays import FloatArray, robust_sigma
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.joint.answer.free_function import EffectView, Seen
from bayes_hw.identify.holes import without_holes

BINS = 16


def binned(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middles, root mean squares and half widths of 94 % intervals of y in bins of equal counts of x."""
    order = np.argsort(x)
    parts = [part for part in np.array_split(order, BINS) if len(part) > 4]
    middle = np.array([np.median(x[part]) for part in parts])
    size = np.array([np.sqrt(np.mean(y[part] ** 2)) for part in parts])
    return middle, size, NORMAL_HALF_WIDTH * size / np.sqrt([2 * len(part) for part in parts])


def late_readings(seen: Seen, label: str) -> EffectView:
    """Error over speed: readings at the wrong instant err in proportion to it, those that show the sample
    before by a step."""
    runs, unit = seen.runs(seen.fit.values), seen.records[0].units.output
    read = [record.measured_samples for record in seen.records]
    speed = np.abs(np.concatenate([np.gradient(run.w)[m] for run, m in zip(runs, read, strict=True)]))
    white = [
        seen.fit.point.whitener.apply(e[None], 0, r.measured)[0]
        for e, r in zip(seen.fit.errors, seen.records, strict=True)
    ]
    error = np.concatenate([e[m] for e, m in zip(white, read, strict=True)])
    x, y, half = binned(speed, error)
    told = seen.readings.parameters
    shares = sum(told.get(f"{label}.share_{kind}", 0.0) for kind in ("repeated", "held"))
    late = np.sqrt((told.get(f"{label}.sd", 0.0) * seen.rate) ** 2 + shares)
    line = np.linspace(0.0, float(x[-1]), 60)
    level = np.sqrt(max(float(y[0]) ** 2 - (late * float(x[0])) ** 2, 0.0))
    return EffectView(
        "size of the error", unit, "speed of the axis, either way", f"{unit}/s", x * seen.rate, y, half,
        line * seen.rate, np.sqrt(level**2 + (late * line) ** 2),
        "Root mean square error over speed (points, 94 % intervals) and what late or early samples give "
        "(line). Noise of the encoder alone is level.",
    )  # fmt: skip


def rounding(seen: Seen, label: str) -> EffectView:
    """Share of the readings over where they lie within one step."""
    step = seen.readings.parameters.get(f"{label}.step")
    if step is None:
        return error_over_time(seen, label)
    y = np.concatenate([record.y[record.measured_samples] for record in seen.records]) / step
    place = y - np.round(y)
    count, edges = np.histogram(place, BINS + 5, range=(-0.5, 0.5))
    share = 100 * count / len(place)
    half = NORMAL_HALF_WIDTH * 100 * np.sqrt(np.maximum(count, 1)) / len(place)
    middle = (edges[1:] + edges[:-1]) / 2
    unit = seen.records[0].units.output
    return EffectView(
        "share of the readings", "%", f"place of a reading within its step of {step:.4g} {unit}", "steps",
        middle, share, half, middle, np.full(len(middle), 100 / len(middle)),
        "Where readings lie within a step (points). Readings that are not rounded lie everywhere (line).",
    )  # fmt: skip


def glitches(seen: Seen, label: str) -> EffectView:
    """Error of the samples that jump, over time."""
    view = error_over_time(seen, label)
    errors = seen.fit.errors
    at = np.concatenate([np.arange(len(e)) / seen.rate for e in errors])
    joined = np.concatenate(errors)
    level = robust_sigma(joined)
    far = np.abs(joined) > 6 * level
    ends = np.array([0.0, float(at.max())])
    return EffectView(
        "error of single samples", view.quantity_unit, view.over, view.over_unit, at[far], joined[far],
        np.zeros(int(far.sum())), ends, np.full(2, 6 * level),
        "Samples whose error exceeds six times the usual one (line). Noise alone has none.",
    )  # fmt: skip


def slow_torque(seen: Seen, label: str) -> EffectView:
    """Spectrum of what is left."""
    del label
    errors, unit = [without_holes(e) for e in seen.fit.errors], seen.records[0].units.output
    length = min(1024, min(len(e) for e in errors))
    spectra = [welch(e, seen.rate, nperseg=length) for e in errors]
    frequency, power = spectra[0][0][1:], np.mean([s[1][1:] for s in spectra], axis=0)
    floor = np.full(len(frequency), float(np.quantile(power, 0.1)))
    return EffectView(
        "spectrum of the error", f"({unit})^2/Hz", "frequency", "Hz", frequency, power,
        np.zeros(len(power)), frequency, floor,
        "Spectrum of what the best model leaves (points) over the encoder's own level (line). It rises where "
        "a slow torque pushes the axis.", True,
    )  # fmt: skip


def error_over_time(seen: Seen, label: str) -> EffectView:
    """Means of the error over stretches of the record where it is largest."""
    del label
    errors, unit = seen.fit.errors, seen.records[0].units.output
    loudest = max(range(len(errors)), key=lambda i: float(np.nanmean(errors[i] ** 2)))
    e = errors[loudest]
    at = np.flatnonzero(np.isfinite(e))
    e = e[at]
    parts = np.array_split(np.arange(len(e)), min(120, len(e)))
    mean = np.array([float(e[part].mean()) for part in parts])
    white = NORMAL_HALF_WIDTH * float(np.std(np.diff(e))) / np.sqrt(2 * len(parts[0]))
    t = np.array([float(at[part].mean()) for part in parts]) / seen.rate
    return EffectView(
        "error", unit, f"time in {seen.records[loudest].name}", "s", t, mean, np.full(len(t), white),
        np.array([0.0, float(t[-1])]), np.zeros(2),
        "Error of the best model, means of short stretches; the intervals are those of white noise, which "
        "would lie about zero.",
    )  # fmt: skip


def by_turns(seen: Seen, label: str) -> EffectView:
    """Size of the error by a sample's number within the turn that readings have; over time where they have
    none."""
    every = int(seen.readings.parameters.get(f"{label}.every", 0))
    if not every:
        return error_over_time(seen, label)
    read = [record.measured_samples for record in seen.records]
    errors = np.concatenate([e[m] for e, m in zip(seen.fit.errors, read, strict=True)])
    turn = np.concatenate([np.flatnonzero(m) % every for m in read])
    counts = np.bincount(turn, minlength=every)
    size = np.sqrt(np.bincount(turn, errors**2, every) / np.maximum(counts, 1))
    numbers, unit = np.arange(float(every)), seen.records[0].units.output
    best = float(np.min(size, where=counts > 0, initial=np.inf))
    return EffectView(
        "size of the error", unit, f"number of the sample, counted to {every}", "samples",
        numbers, size, NORMAL_HALF_WIDTH * size / np.sqrt(2 * np.maximum(counts, 1)),
        np.array([-0.5, every - 0.5]), np.full(2, best),
        f"Root mean square error of the samples by their number, which starts again after {every} (points, "
        "94 % intervals), and that of the best of them (line). Readings that are all made alike lie on it.",
    )  # fmt: skip
