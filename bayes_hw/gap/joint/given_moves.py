"""Moves of the search around a given model: laws through the same ports, more delay, a further mode, noise of
a cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.gap.joint.effect_codes import BASE_POSITION, MODULATED
from bayes_hw.gap.joint.effect_form import FORMS
from bayes_hw.gap.joint.effect_screen import noise_screens
from bayes_hw.gap.joint.given_model import FURTHER
from bayes_hw.gap.joint.given_response import DELAY, MODE, GivenFit
from bayes_hw.gap.joint.joint_fit import highest
from bayes_hw.gap.joint.joint_moves import FIRST_STEPS, SECOND_STEPS
from bayes_hw.gap.joint.slow_noise import WALK, WIND, SlowNoise

FURTHER_HZ = 18
FURTHER_DAMPING = 0.02
LONGEST_DELAY_S, MOST_DELAY, DELAYS_TRIED, DELAYS_KEPT = 0.6, 25, 8, 2
"""Of a further delay: seconds and samples at most, starts, and how many go on."""

FEW_STARTS, STARTS_KEPT = 3, 3

LIGHT = 0.25
"""Damping ratio of the pairs of G that a slow torque is seen to shake."""

NEARLY_INTEGRAL = 1e-3


def as_given(found: object) -> GivenFit:
    assert isinstance(found, GivenFit)
    return found


def best_of(fits: Sequence[object]) -> GivenFit:
    return as_given(highest(fits))  # type: ignore[arg-type]


def with_signals(fits: Sequence[GivenFit]) -> list[GivenFit]:
    """Those whose last effect is a torque, its law looking at the states of G too."""
    found = []
    for fit in fits:
        effects = fit.values.effects
        ports = effects[-1].ports
        if ports is not None and not ports.signal:
            found.append(as_given(fit.with_signal(len(effects) - 1).descended()))
    return found


def every_law(fit: GivenFit) -> list[GivenFit]:
    """Of every label that the fit lacks the best law through ports of its own, looking at the states of G.

    All of its starts are followed: neither what a start promises nor a few steps without the states tell
    which law it is. Laws of the position are left out, their starts are too many.
    """
    found: dict[str, list[GivenFit]] = {}
    last = len(fit.values.effects)
    for form in FORMS:
        if not form.is_law or form.further or form.base == BASE_POSITION or form.law == MODULATED:
            continue
        if form.label not in fit.labels:
            starts = [fit.with_effect(form, s).with_signal(last) for s in form.starts(fit.response.scale)]
            found.setdefault(form.label, []).extend(as_given(s.descended(SECOND_STEPS)) for s in starts)
    return [
        best_of([t.descended() for t in sorted(begun, key=lambda t: -t.score)[:STARTS_KEPT]])
        for begun in found.values()
    ]


def other_laws(fit: GivenFit) -> list[GivenFit]:
    """Where the last effect is a torque: other labels' laws of the same signal, through the same ports."""
    last = len(fit.values.effects) - 1
    if last < 0 or fit.values.effects[last].ports is None:
        return []
    form, scale = fit.values.effects[last].form, fit.response.scale
    found = []
    for other in FORMS:
        if other.is_law and other.base == form.base and other.label not in fit.labels:
            starts = [fit.with_form(last, other, start) for start in other.starts(scale)[:FEW_STARTS]]
            found.append(as_given(best_of([start.descended(SECOND_STEPS) for start in starts]).descended()))
    return found


def pruned(fit: GivenFit) -> GivenFit:
    """Labels taken out while the score improves."""
    while len(fit.labels) > 1:
        best = best_of([fit.without(label).descended() for label in fit.labels])
        if best.score <= fit.score:
            return fit
        fit = best
    return fit


def later(fit: GivenFit) -> list[GivenFit]:
    """The best fit with more delay, whole and a part of a sample; none where the fit has it."""
    if DELAY in fit.labels:
        return []
    longest = min(LONGEST_DELAY_S * fit.response.scale.rate_hz, MOST_DELAY)
    grid = np.unique(np.round(np.geomspace(0.4, max(longest, 1.0), DELAYS_TRIED), 1))
    starts = [fit.with_delay(int(n), float(n) % 1) for n in grid]
    tried = [as_given(t.descended_under(1, FIRST_STEPS)) for t in starts]
    tried.sort(key=lambda t: -t.score)
    return [as_given(best_of([_settled_delay(t).descended() for t in tried[:DELAYS_KEPT]]))]


def _settled_delay(fit: GivenFit) -> GivenFit:
    """Moved on by whole samples while the part of one stands at an end."""
    for _ in range(MOST_DELAY):
        part, whole = float(fit.theta[fit.response.given.size]), fit.extra_delay
        if part > 0.97:
            other = fit.with_delay(whole + 1, part - 0.9)
        elif part < 0.03 and whole > 0:
            other = fit.with_delay(whole - 1, part + 0.9)
        else:
            break
        moved = as_given(other.descended_under(1, FIRST_STEPS))
        if moved.score <= fit.score:
            break
        fit = moved
    return fit


def slow_causes(fit: GivenFit) -> list[GivenFit]:
    """The fit with noise that wind or a walking angle explains; none where it has one, or noise that is
    white or of the first order."""
    response = fit.response
    if response.cause is not None or fit.point.whitener.order <= 1:
        return []
    sections, real = fit.values.cascade.sections, fit.values.cascade.real[0]
    pairs = np.array([np.roots([1.0, -a1, a2]) for a1, a2 in sections[:2].T], dtype=np.complex128).ravel()
    slow = real[np.abs(real - 1) > NEARLY_INTEGRAL].astype(np.complex128)
    damping = -np.log(pairs).real / np.abs(np.log(pairs))
    sets = (pairs[damping < LIGHT], np.concatenate([pairs, slow]))
    return [
        as_given(fit.with_cause(SlowNoise(cause, response.scale.rate_hz, sets)).descended()).with_noise_kept()
        for cause in (WIND, WALK)
        if cause not in fit.labels
    ]


def further_modes(fit: GivenFit) -> list[GivenFit]:
    """The best fits with a further mode, from a grid of frequencies; none where the fit has one."""
    if MODE in fit.labels:
        return []
    rate = fit.response.scale.rate_hz
    records = fit.response.records
    lowest = max(0.05, 4 / max(record.duration_s for record in records))
    screens = noise_screens(fit)
    promised = []
    for hz in np.geomspace(lowest, 0.42 * rate, FURTHER_HZ):
        larger = fit.with_mode(float(hz), FURTHER_DAMPING)
        at = larger.response.given.size + int(larger.response.part)
        rows = [r[at : at + FURTHER] for r, _, _ in larger.response.linearise(larger.point.coordinates, 0)]
        promised.append((max(screen.gain(rows) for screen in screens), larger))
    promised.sort(key=lambda item: -item[0])
    tried = [as_given(larger.descended(SECOND_STEPS)) for _, larger in promised[:3]]
    return [as_given(best_of(tried).descended())]
