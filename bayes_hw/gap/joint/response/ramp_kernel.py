"""A command behind limits of rate and size, compiled, with derivatives."""

from __future__ import annotations

from bayes_hw.compiled import compiled_inside


@compiled_inside
def ramped(target, before, slowness):  # type: ignore[no-untyped-def]
    """Mean of a ramp from `before` towards `target` over one sample and its value at the end, with their
    derivatives by the slowness (samples per unit) and by the value before."""
    step = target - before
    size = abs(step)
    if size * slowness <= 1.0:
        lost = step * size * slowness / 2
        return target - lost, target, -step * size / 2, size * slowness, 0.0, 0.0
    sign = 1.0 if step > 0 else -1.0
    reach = sign / slowness
    by_slowness = -sign / slowness**2
    return before + reach / 2, before + reach, by_slowness / 2, 1.0, by_slowness, 1.0


@compiled_inside
def ramped_within(target, before, slowness, lowest, highest):  # type: ignore[no-untyped-def]
    """Mean over one sample of a ramp from `before` towards `target` that is limited behind, its derivatives
    by both limits, by the slowness (samples per unit) and by the value before; the ramp's value at the end
    and its derivatives by the slowness and the value before."""
    step = target - before
    size = abs(step)
    sign = 1.0 if step > 0 else -1.0
    if size * slowness <= 1.0:
        end, ramping, reach = target, size * slowness, step
        end_by_rate, end_by_before = 0.0, 0.0
    else:
        reach = sign / slowness
        end, ramping = before + reach, 1.0
        end_by_rate, end_by_before = -sign / slowness**2, 1.0
    if lowest <= min(before, end) and max(before, end) <= highest:
        mean, by_rate, by_before = end - ramping * reach / 2, end_by_rate / 2, 1.0
        if end == target:
            by_rate, by_before = -step * size / 2, size * slowness
        return mean, 0.0, 0.0, by_rate, by_before, end, end_by_rate, end_by_before
    first, first_by_lowest, first_by_highest = _limited_integral(before, lowest, highest)
    last, last_by_lowest, last_by_highest = _limited_integral(end, lowest, highest)
    held = min(max(end, lowest), highest)
    begun = min(max(before, lowest), highest)
    if end == target:
        per = sign * slowness
        mean = per * (last - first) + (1 - ramping) * held
        by_rate = sign * (last - first) - size * held
        by_before = per * (held - begun)
    else:
        per = 1 / reach
        mean = per * (last - first)
        by_rate = (held * per - mean * per) * end_by_rate
        by_before = per * (held - begun)
    by_lowest = per * (last_by_lowest - first_by_lowest)
    by_highest = per * (last_by_highest - first_by_highest)
    if end < lowest:
        by_lowest += 1 - ramping
    elif end > highest:
        by_highest += 1 - ramping
    return mean, by_lowest, by_highest, by_rate, by_before, end, end_by_rate, end_by_before


@compiled_inside
def _limited_integral(x, lowest, highest):  # type: ignore[no-untyped-def]
    """Antiderivative at x of the limiter, and its derivatives by both limits."""
    if x > highest:
        return highest * x - highest**2 / 2, 0.0, x - highest
    if x < lowest:
        return lowest * x - lowest**2 / 2, x - lowest, 0.0
    return x * x / 2, 0.0, 0.0
