"""What a label must be worth around a given model: when it is dropped and what is left of the explanation
goes to its end, by every form and step that its labels have."""

from __future__ import annotations

from collections.abc import Callable

from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.settled import settled
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.search.verification import asked_over
from bayes_hw.phrases import log_evidence

LEAST_SLOW, LEAST_BESIDE = 0.3, 0.6
"""Standard deviation of a slow error over that of the readings' noise to be named alone, beside a label."""


def verified(
    fit: GivenFit, base: GivenFit, readings: Readings, say: Callable[[str], None]
) -> tuple[GivenFit, dict[str, float]]:
    """Labels that are still worth what is asked of them when each is dropped and the rest goes to its end:
    what a label seems to be worth beside another may be that one's, which had not come to its end."""
    while fit.labels:
        nats, rest = {}, {}
        for label in dict.fromkeys(fit.labels):
            without = settled(fit.without(label).descended())
            if len(fit.labels) == 1:
                without = highest([without, base])
            nats[label], rest[label] = fit.score - without.score, without
        say("without it: " + ", ".join(f"{label} {log_evidence(-value)}" for label, value in nats.items()))
        if is_too_small(fit):
            weakest = fit.added[-1]
        else:
            weakest = min(nats, key=lambda label: nats[label])
            if nats[weakest] >= asked_over(fit, rest[weakest], base, readings):
                return fit, nats
        fit = rest[weakest]
    return fit, {}


def is_doubtful(best: GivenFit, fit: GivenFit, base: GivenFit, readings: Readings) -> bool:
    """Whether one label more is worth too little to be verified. Beside such a first one nothing further is
    looked for."""
    if len(best.labels) <= len(fit.labels):
        return False
    return best.score < fit.score + asked_over(best, fit, base, readings)


def is_too_small(fit: GivenFit) -> bool:
    """Whether the noise has a cause too small to be told from what forms of the other labels leave."""
    if fit.slow is None:
        return False
    innovation = (fit.point.sum_of_squares / fit.point.samples) ** 0.5
    least = LEAST_BESIDE if len(fit.labels) > 1 else LEAST_SLOW
    return fit.slow.slow_share(fit.point.rms, innovation) < least
