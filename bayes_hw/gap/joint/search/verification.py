"""What a label must be worth when it is dropped and G grown again."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.joint_fit import JointFit, highest
from bayes_hw.gap.joint.fit.structure_moves import regrown
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.residuals.remainder import coloured_nats, leaves_a_cause
from bayes_hw.phrases import log_evidence

VERIFIED_NATS = 25.0
"""That a label must be worth when it is dropped and G grown again."""

VERIFIED_BESIDE_NATS = 80.0
"""Where readings are rounded, held or late, so that the noise is not normal; and where it is of high order,
which is something that no label explains. Also of every label where the noise has a cause and an effect
stands beside it: forms follow slow noise a little. So they do in observer form, whose readings follow any
torque."""

FORM_SHARE = 0.04
"""Of the nats that an explanation of several labels gains, that each must be worth: no form is exact, and
what its error leaves grows with what it explains."""


def asked_of(fit: JointFit, base: JointFit, readings: Readings) -> float:
    """Nats that a label of this fit must be worth, which explains what a `base` without labels does not."""
    several = len(set(fit.labels)) > 1
    beside = fit.response.cause is not None and several
    doubtful = readings.nats or fit.noise_order > 1 or beside or fit.observer is not None
    asked = VERIFIED_BESIDE_NATS if doubtful else VERIFIED_NATS
    return max(asked, FORM_SHARE * (fit.score - base.score)) if several else asked


def asked_over(fit: JointFit, without: JointFit, base: JointFit, readings: Readings) -> float:
    """Nats that a label of this fit must be worth over an explanation `without` it. Where that leaves noise
    with a cause that nothing names, the label is held against that cause, not against nothing: what it takes
    away of the colour counts for it."""
    asked = asked_of(fit, base, readings)
    if fit.observer is None and leaves_a_cause(without) and not leaves_a_cause(fit):
        asked = max(asked - coloured_nats(without) + coloured_nats(fit), 0.0)
    return asked


def verified(
    fit: JointFit,
    base: JointFit,
    others: Sequence[JointFit],
    readings: Readings,
    say: Callable[[str], None],
) -> tuple[JointFit, dict[str, float]]:
    """Labels that are still worth enough nats when each is dropped and G grown again, with those nats.

    The `base` has none; any of the `others`, of the labels that are left and under the same weights, may do
    better than that. In observer form the readings themselves follow a cause that nothing names, and the last
    label must be worth more than their following is.
    """
    known = [base, *others]
    bare = [one for one in known if not one.labels and one.observer is None]
    while fit.labels:
        nats: dict[str, float] = {}
        alternatives = []
        weights = fit.response.weights
        for label, without in zip(
            fit.labels, each(regrown, [fit.without(x) for x in fit.labels]), strict=True
        ):
            same = [o for o in known if o.labels == without.labels and o.response.weights is weights]
            alternatives.append(highest([without, *same]))
            nats[label] = fit.score - alternatives[-1].score
        say("without it: " + ", ".join(f"{label} {log_evidence(-value)}" for label, value in nats.items()))
        weakest = int(np.argmin([nats[label] for label in fit.labels]))
        asked = asked_over(fit, alternatives[weakest], base, readings)
        if fit.observer is not None and len(fit.labels) == 1:
            asked = max(asked, alternatives[weakest].score - highest(bare).score)
        if nats[fit.labels[weakest]] >= asked:
            return fit, nats
        fit = alternatives[weakest]
    # What is left of an observer without laws is coloured noise, which is free as it is.
    return highest(bare if fit.observer is not None else [fit, *bare]), {}
