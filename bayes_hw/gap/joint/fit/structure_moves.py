"""Moves of the joint search that change the structure of G: larger and smaller cascades, the delay."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from bayes_hw.gap.joint.fit.joint_fit import JointFit, descended_each, highest, raced
from bayes_hw.gap.joint.fit.other_cascades import later, smaller_cascades, with_pole, with_section
from bayes_hw.identify.growth.delay import longest_delay
from bayes_hw.identify.growth.score_test import best_candidates
from bayes_hw.time_budget import time_is_up

Extension = Callable[[JointFit], JointFit]

REGROWTHS = 4
SLACK_NATS = 0.5


def extensions(fit: JointFit, count: int = 3) -> list[Extension]:
    """What adds a pole or a section of no weight to a fit of its structure, the most promising for it."""
    real, pairs = best_candidates(fit.response, fit.point, count)  # type: ignore[arg-type]
    found: list[Extension] = [partial(with_pole, pole=c.a1) for c in real[:1]]
    return found + [partial(with_section, a1=c.a1, a2=c.a2) for c in pairs if c.a2 is not None]


def larger_cascades(fit: JointFit, count: int = 3) -> list[JointFit]:
    """Fits with one more pole or section, the most promising."""
    return [extend(fit) for extend in extensions(fit, count)]


def regrown(fit: JointFit, steps: int = REGROWTHS) -> JointFit:
    """G grown on as far as the score improves, `steps` poles or sections at most."""
    best = fit = fit.descended()
    failures = 0
    for _ in range(steps):
        if time_is_up():
            break
        trials = sorted(descended_each(larger_cascades(fit), 6), key=lambda t: -t.score)[:2]
        fit = highest(raced(trials))
        if fit.score > best.score:
            best, failures = fit, 0
        else:
            failures += 1
            if failures == 2:
                break
    return best


def pruned(fit: JointFit) -> JointFit:
    """Effects, an observer, sections and poles taken out while the score improves."""
    while not time_is_up():
        trials: list[JointFit] = []
        if len(fit.labels) > 1:
            trials += [fit.without(label) for label in fit.labels]
        if fit.observer is not None:
            trials.append(fit.without_observer())
        trials += smaller_cascades(fit)
        if not trials:
            return fit
        trials = sorted(descended_each(trials, 4), key=lambda t: -t.score)[:2]
        best = highest(raced(trials, fit.score))
        if best.score <= fit.score:
            return fit
        fit = best
    return fit


def delayed(fit: JointFit) -> JointFit:
    """The delay advanced while that costs next to nothing: a delay that G's poles make up sets them free."""
    longest = longest_delay(fit.response.records)
    while fit.structure.delay_samples < longest:
        advanced = later(fit).descended()
        if advanced.score < fit.score - SLACK_NATS:
            break
        fit = advanced
    return fit


def widened(fit: JointFit, steps: int = 2) -> tuple[JointFit, tuple[Extension, ...]]:
    """G grown on by poles and sections that Akaike's criterion keeps (1974, doi 10.1109/TAC.1974.1100705),
    and what gives the fit that structure without them.

    What Schwarz's leaves out moves the other parameters by up to several of their standard deviations; with
    it in, they are as uncertain as they are. Sections keep their order, further ones come last.
    """
    taken: list[Extension] = []
    for _ in range(steps):
        if time_is_up():
            break
        every = extensions(fit)
        begun = zip(every, descended_each([extend(fit) for extend in every], 6), strict=True)
        kept = sorted(begun, key=lambda one: -one[1].log_likelihood)[:2]
        ended = zip(kept, descended_each([trial for _, trial in kept]), strict=True)
        better = [(extend, trial) for (extend, _), trial in ended if _akaike(trial) > _akaike(fit)]
        if not better:
            break
        extend, fit = max(better, key=lambda one: _akaike(one[1]))
        taken.append(extend)
    return fit, tuple(taken)


def _akaike(fit: JointFit) -> float:
    likelihood = fit.log_likelihood - fit.free_count
    return likelihood if np.isfinite(likelihood) else -np.inf
