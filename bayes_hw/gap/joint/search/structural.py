"""What the effects of a fit ask for: other ports, forms and laws, a larger G, steps within the sample."""

from __future__ import annotations

from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, AnyFit, JointFit, descended_each, highest, raced
from bayes_hw.gap.joint.fit.structure_moves import larger_cascades
from bayes_hw.gap.joint.search.effect_moves import FIRST_STEPS, port_candidates
from bayes_hw.gap.joint.search.law_exchange import exchanged
from bayes_hw.gap.joint.search.sight import is_hidden_friction
from bayes_hw.time_budget import time_is_up

STRUCTURAL_NATS = 5.0
"""A port or a section that gains as much is taken before another effect is looked for."""

WHITE_ROUNDS, LITTLE_NATS = 3, 5.0
"""Descents under white noise, while one gains more than a little."""

MOST_RACED = 3
"""Ports, forms, poles and sections that are raced against each other, begun under either noise."""


def structural(fit: JointFit) -> JointFit:
    """The best of the present effects with other ports, another form of their law, or a larger G; where the
    noise is of high order, which may have taken up what they explain, begun under noise of the first too,
    and with finer steps where none of it helps. A law that begins to look at a motion of its own is held
    against other laws over that motion, before G grows to make up for the wrong one."""
    if time_is_up():
        return fit
    trials = port_candidates(fit) + larger_cascades(fit)
    begun = sorted(descended_each(trials, FIRST_STEPS), key=lambda t: -t.score)[:MOST_RACED]
    coloured = fit.noise_order > 1
    if coloured:
        under = each(lambda t: t.descended_under(1, FIRST_STEPS), trials)
        begun += sorted(under, key=lambda t: -t.score)[:MOST_RACED]
    best = highest([fit, *raced(begun, fit.score)])
    if looking(best) > looking(fit):
        others = [one for one in exchanged(best) if not is_hidden_friction(one)]
        best = highest([best, *others])
    if not coloured or best.score >= fit.score + STRUCTURAL_NATS:
        return best
    return finer(best)


def looking(fit: JointFit) -> int:
    """How many of its laws look at a motion of their own."""
    return sum(e.looks_at_states for e in fit.values.effects)


def finer(fit: AnyFit) -> AnyFit:
    """With effects that act several times a sample, where the noise asks for it and that is better."""
    return within_sample(fit) if fit.point.whitener.order > 0 else fit


def within_sample(fit: AnyFit) -> AnyFit:
    """With effects that act several times a sample, where that is better."""
    within = any(e.acts_within_sample for e in fit.response.template)
    if not within or fit.response.steps > 1:
        return fit
    trial = highest(raced([fit.finer()], fit.score + STRUCTURAL_NATS))
    return trial if trial.score > fit.score + STRUCTURAL_NATS else fit


def explained_slowly(fit: AnyFit) -> AnyFit:
    """Where the noise is a free one of higher order: descended under white noise first, under which what is
    slow is not left to the noise, if that ends no worse; limits that no command reaches begun where one does,
    as well."""
    if fit.noise_order <= 1 or not fit.labels:
        return fit
    reached = fit.with_limits_reached()
    if reached is not fit:
        fit = highest([fit, reached.descended_under(0, FULL_STEPS).descended()])
    for _ in range(WHITE_ROUNDS):
        other = highest([fit, fit.descended_under(0, FULL_STEPS).descended()])
        if other.score < fit.score + LITTLE_NATS:
            return other
        fit = other
    return fit
