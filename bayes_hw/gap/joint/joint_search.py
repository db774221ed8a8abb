"""The search for structure and effects together: grow, prune, advance the delay, verify."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.gap.joint.base_cascade import grown_base
from bayes_hw.gap.joint.effect_form import FORMS
from bayes_hw.gap.joint.joint_fit import JointFit, highest
from bayes_hw.gap.joint.joint_moves import (
    FIRST_STEPS,
    delayed,
    effect_candidates,
    larger_cascades,
    port_candidates,
    pruned,
    regrown,
)
from bayes_hw.gap.joint.readings import Readings, read_faults, weighted
from bayes_hw.gap.joint.remainder import Remainder, remainder_of
from bayes_hw.identify.experiment import white_noise_level
from bayes_hw.record import Record

VERIFIED_NATS = 25.0
"""That a label must be worth when it is dropped and G grown again."""

VERIFIED_BESIDE_NATS = 80.0
"""Where readings are rounded, held or late, so that the noise is not normal."""

STRUCTURAL_NATS = 5.0
"""A port or a section that gains as much is taken before another effect is looked for."""

MOST_EFFECTS, MOST_STEPS = 3, 10


@dataclass(frozen=True, eq=False)
class JointAnswer:
    """What the search found: `fit` with its effects, `base` the best without any, the verified nats of every
    label, the best score over the base's that every label reached alone, faults of the readings, and what is
    left."""

    fit: JointFit
    base: JointFit
    nats: Mapping[str, float]
    rivals: Mapping[str, float]
    readings: Readings
    remainder: Remainder


def search(records: Sequence[Record], say: Callable[[str], None] | None = None) -> JointAnswer:
    """Grow, prune, verify; `say` is told of every step."""
    told = say or _silent
    base, readings = _begun(records, told)
    fit, base, readings, rivals = _grown(base, readings, told)
    if fit.labels:
        fit = pruned(delayed(pruned(fit)))
        told(f"pruned: {described(fit)}")
        base, fit, readings = _read_again(base, fit, readings)
    fit, nats = verified(fit, base, VERIFIED_BESIDE_NATS if readings.nats else VERIFIED_NATS, told)
    return JointAnswer(fit, base, nats, rivals, readings, remainder_of(fit))


def described(fit: JointFit) -> str:
    """One line on a fit."""
    names = " + ".join(fit.names) or "no effect"
    order, noise = fit.structure.order, fit.point.whitener.order
    return f"{names}; G of order {order}, delay {fit.structure.delay_samples}, noise of order {noise}"


def _silent(message: str) -> None:
    del message


def _begun(records: Sequence[Record], say: Callable[[str], None]) -> tuple[JointFit, Readings]:
    """The best cascade without effects under the weights that the readings' faults ask for."""
    base = grown_base(records, white_noise_level([record.y for record in records]))
    readings = read_faults(base)
    if any(np.any(w != 1) for w in readings.weights):
        base = weighted(base, readings.weights)
        again = read_faults(replace(base, response=replace(base.response, weights=None)))
        if "outliers" in readings.nats and again.nats.get("outliers", 0) > 0:
            readings = again
            base = weighted(base, readings.weights)
    say(f"without effects: {described(base)}")
    return base, readings


def _read_again(base: JointFit, fit: JointFit, readings: Readings) -> tuple[JointFit, JointFit, Readings]:
    """Faults of timing that only an explanation on the way seemed to show are taken back."""
    if "timing_jitter.sd" not in readings.parameters:
        return base, fit, readings
    again = read_faults(replace(fit, response=replace(fit.response, weights=None)))
    if "timing_jitter" in again.nats:
        return base, fit, readings
    return weighted(base, again.weights), weighted(fit, again.weights), again


def _structural(fit: JointFit) -> JointFit:
    """The best of the present effects with other ports, another form of their law, or a larger G."""
    trials = port_candidates(fit) + larger_cascades(fit)
    trials = sorted((t.descended(FIRST_STEPS) for t in trials), key=lambda t: -t.score)[:3]
    return highest([fit, *(t.descended() for t in trials)])


def _grown(
    base: JointFit, readings: Readings, say: Callable[[str], None]
) -> tuple[JointFit, JointFit, Readings, dict[str, float]]:
    """The fit with effects, the base and the readings under the last weights, and what every label alone
    reached."""
    fit, rivals = base, dict[str, float]()
    for step in range(MOST_STEPS):
        best = _structural(fit) if step else fit
        if best.score < fit.score + STRUCTURAL_NATS and len(fit.labels) < MOST_EFFECTS:
            trials = effect_candidates(fit, FORMS)
            if step == 0:
                rivals = {t.labels[-1]: t.score - base.score for t in trials}
            best = highest([best, *trials])
        if best.score <= fit.score:
            break
        say(f"{best.score - fit.score:.0f} nats: {described(best)}")
        fit = best
        if fit.labels and not readings.nats:
            later = read_faults(fit)
            if later.nats:
                readings = later
                base, fit = weighted(base, later.weights), weighted(fit, later.weights)
    return fit, base, readings, rivals


def verified(
    fit: JointFit, base: JointFit, asked: float, say: Callable[[str], None]
) -> tuple[JointFit, dict[str, float]]:
    """Labels that are still worth `asked` nats when each is dropped and G grown again, with those nats."""
    while fit.labels:
        nats: dict[str, float] = {}
        alternatives = []
        for i, label in enumerate(fit.labels):
            without = regrown(fit.without_effect(i))
            if len(fit.labels) == 1:
                without = highest([without, base])
            nats[label] = fit.score - without.score
            alternatives.append(without)
        say("verified: " + ", ".join(f"{label} {value:.0f} nats" for label, value in nats.items()))
        weakest = int(np.argmin([nats[label] for label in fit.labels]))
        if nats[fit.labels[weakest]] >= asked:
            return fit, nats
        fit = alternatives[weakest]
    return fit, {}
