"""Moves of the search around a given model: laws through the same ports, more delay, a further mode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import highest_peaks
from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.forms.drive_forms import GIVEN_FORMS
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.given.base_starts import with_nominal_modes
from bayes_hw.gap.joint.given.given_model import FURTHER, HEAVIEST, LIGHTEST
from bayes_hw.gap.joint.given.given_response import DELAY, MODE, GivenFit
from bayes_hw.gap.joint.residuals.noise_screen import noise_screens
from bayes_hw.gap.joint.search.effect_moves import (
    FIRST_STEPS,
    SECOND_STEPS,
    effect_candidates,
    other_forms,
)
from bayes_hw.gap.joint.search.structural import explained_slowly
from bayes_hw.time_budget import time_is_up

FURTHER_HZ, FURTHER_TRIED = 18, 3
"""Of a further mode, frequencies and how many peaks of what they promise are tried."""

FURTHER_DAMPING, AT_AN_END = 0.02, 0.05
"""Damping ratio that a further mode begins with, and the logarithm's distance from an end of its range."""

LONGEST_DELAY_S, MOST_DELAY, DELAYS_TRIED, DELAYS_KEPT = 0.6, 25, 8, 2
"""Of a further delay: seconds and samples at most, starts, and how many go on."""

FEW_STARTS = 3
"""Starts of another law of a signal."""


def with_signals(fits: Sequence[GivenFit]) -> list[GivenFit]:
    """Those whose last effect is a torque, its law looking at the states of G too."""
    found = []
    for fit in fits:
        effects = fit.values.effects
        ports = effects[-1].ports if effects else None
        if ports is not None and not ports.signal:
            found.append(fit.with_signal(len(effects) - 1).descended())
    return found


def with_further_forms(fits: Sequence[GivenFit]) -> list[GivenFit]:
    """Those whose last effect has a form that extends it (a second harmonic), in that form: what a label is
    worth beside others shows only there."""
    found = []
    for fit in fits:
        effects = fit.values.effects
        if effects:
            last = len(effects) - 1
            forms = other_forms(effects[last], fit.response.scale)
            found += [fit.with_form(last, f, start).descended() for f, start in forms if f.further]
    return found


def both_over_position(fit: GivenFit) -> list[GivenFit]:
    """The best explanations by both labels that are errors of the reading over position: noise takes up what
    either leaves of the other, so that neither alone shows what it is worth."""
    found = effect_candidates(fit, forms_of("gain_asymmetry"))
    return [
        explained_slowly(t) for one in found for t in effect_candidates(one, forms_of("encoder_eccentricity"))
    ]


def forms_of(label: str) -> list[Form]:
    return [form for form in GIVEN_FORMS if form.label == label]


def something_is_left(fit: GivenFit, found: Sequence[GivenFit]) -> bool:
    """Whether the best explanation so far leaves noise of higher order, or of a cause."""
    return highest([fit, *found]).point.whitener.order > 1


def other_laws(fit: GivenFit) -> list[GivenFit]:
    """Where the last effect is a torque: other labels' laws of the same signal, through the same ports."""
    last = len(fit.values.effects) - 1
    if last < 0 or fit.values.effects[last].ports is None:
        return []
    form, scale = fit.values.effects[last].form, fit.response.scale
    found = []
    for other in GIVEN_FORMS:
        if other.is_law and not other.further and other.base == form.base and other.label not in fit.labels:
            starts = [fit.with_form(last, other, start) for start in other.starts(scale)[:FEW_STARTS]]
            tried = [start.descended(SECOND_STEPS) for start in starts]
            found += [highest(tried).descended()] if tried else []
    return found


def pruned(fit: GivenFit) -> GivenFit:
    """Labels taken out while the score improves."""
    while len(fit.labels) > 1:
        best = highest([fit.without(label).descended() for label in fit.labels])
        if best.score <= fit.score:
            return fit
        fit = best
    return fit


def later(fit: GivenFit) -> list[GivenFit]:
    """The best fit with more delay, whole and a part of a sample; none where the fit has it. Modes are begun
    where they are and where the model has them: they may have taken up the delay."""
    if DELAY in fit.labels or time_is_up():
        return []
    longest = min(LONGEST_DELAY_S * fit.response.scale.rate_hz, MOST_DELAY)
    grid = np.unique(np.round(np.geomspace(0.4, max(longest, 1.0), DELAYS_TRIED), 1))
    places = (fit, with_nominal_modes(fit))
    starts = [place.with_delay(int(n), float(n) % 1) for place in places for n in grid]
    tried = [t.descended_under(1, FIRST_STEPS) for t in starts]
    tried.sort(key=lambda t: -t.score)
    return [highest([t.descended() for t in tried[:DELAYS_KEPT]])]


def further_modes(fit: GivenFit) -> list[GivenFit]:
    """The best fit with a further mode, begun where a grid of frequencies promises most; none where the fit
    has one, or where that ends at none."""
    if MODE in fit.labels or time_is_up():
        return []
    rate = fit.response.scale.rate_hz
    records = fit.response.records
    lowest = max(0.05, 4 / max(record.duration_s for record in records))
    screens = noise_screens(fit)
    begun, promised = [], []
    for hz in np.geomspace(lowest, 0.42 * rate, FURTHER_HZ):
        larger = fit.with_mode(float(hz), FURTHER_DAMPING)
        at = larger.response.first_of_mode
        rows = [r[at : at + FURTHER] for r, _, _ in larger.response.linearise(larger.point.coordinates, 0)]
        begun.append(larger)
        promised.append(max(screen.gain(rows) for screen in screens))
    peaks = highest_peaks(np.array(promised))[:FURTHER_TRIED]
    tried = [begun[i].descended(SECOND_STEPS) for i in peaks]
    best = highest(tried).descended()
    return [best] if is_a_mode(best) else []


def modes_beside(fits: Sequence[GivenFit]) -> list[GivenFit]:
    """A further mode beside the best of every label, where the two leave nothing: while the poles of G are
    held where the model has them, a label that is right may explain less than many a wrong one."""
    alone = [fit for fit in best_of_labels(fits) if len(set(fit.labels)) == 1]
    return [t for fit in alone for t in further_modes(fit) if t.noise_order <= 1]


def best_of_labels(fits: Sequence[GivenFit]) -> list[GivenFit]:
    """The best of those that have the same labels, the best of all first."""
    best: dict[tuple[str, ...], GivenFit] = {}
    for fit in sorted(fits, key=lambda t: -t.score):
        best.setdefault(fit.labels, fit)
    return list(best.values())


def is_a_mode(fit: GivenFit) -> bool:
    """Whether the further mode of a fit is one of the structure, which has damping of its own. Its zeros may
    stand at its poles: then the roots that it loosens are what the model has wrong."""
    damping = float(fit.theta[fit.response.first_of_mode + 1])
    return LIGHTEST + AT_AN_END < damping < HEAVIEST - AT_AN_END
