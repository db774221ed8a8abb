"""What a diagnosis of records alone found, in one sentence without private words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.verdict import Estimate, Verdict
from bayes_hw.gap.answer.words_of_answer import disagreement, percent, words_of_answer
from bayes_hw.phrases import listed, plainly
from bayes_hw.record import Record
from bayes_hw.record_checks import unrelated

RANDOM = ("wind", "timing_jitter", "outliers", "encoder_quantization")
"""Labels whose effect no simulation follows."""

MOST_SAID = 0.99
"""No share is said to be larger: the noise that it is measured against is itself estimated."""

WELL_KNOWN = 0.1
"""Relative standard deviation below which a limit is said to be one: no command reaches one that is known
less well."""


def beyond_limits(held_out: Record, there: float, here: float) -> str:
    """What is to be said first of a record held out that is commanded up to `there`, where those trained on
    go up to `here` and reach no limit."""
    return (
        f"{held_out.name}, held out, is commanded up to {plainly(there)} {held_out.units.input}, the records "
        f"trained on up to {plainly(here)}, where they reach no limit: where it is cut there is a guess, and "
        "its error tells little of what follows. "
    )


def sentence(verdict: Verdict, simulated: bool, held_out: str, beyond: str = "") -> str:
    """What the axis does, what a plain model of it lacks and how sure that is; how far it then predicts the
    record `held_out`; before all that, whether it disagrees, or goes `beyond` what limits are known of.
    `simulated` says whether an effect of the answer is in the simulation."""
    disagrees = disagreement(verdict)
    beyond = beyond if disagrees else ""
    does = (beyond or disagrees) + axis_words(verdict.base)
    if not verdict.answer:
        return f"{does}; nothing is missing from its model ({percent(verdict.probability['none'])} sure)."
    closed = verdict.gap_holdout.closed
    them = "it" if len(verdict.answer) == 1 else "them"
    worse = verdict.gap_holdout.closed_hdi94[1] < 0
    if worse and not beyond and not set(verdict.answer) & {*RANDOM, OTHER}:
        return (
            f"{does}; in doubt is what a model of limits, linear dynamics and dead zone lacks: the records "
            f"trained on ask for {words_of_answer(verdict.answer, {})}, but with {them} in the model "
            f"{held_out}, held out, is predicted worse than without."
        )
    lacks = words_of_answer(verdict.answer, verdict.probability)
    said = f"{does}; what a model of limits, linear dynamics and dead zone lacks is {lacks}."
    if verdict.answer == (OTHER,):
        return f"{said} No remedy follows from that; the next experiment does."
    if verdict.answer[0] in RANDOM and not simulated:
        return f"{said} It is random: no simulation follows it, and the bands are made wide enough for it."
    if beyond:
        return f"{said} To score it, hold out a record within the commands of the others."
    if worse:
        return f"{said} With {them} in the model, {held_out}, held out, is predicted worse than without."
    size = f"more than {100 * MOST_SAID:.0f} %" if closed > MOST_SAID else f"{100 * max(closed, 0.0):.0f} %"
    return f"{said} With {them} in the model, {size} of the avoidable error is gone on {held_out}, held out."


def unfollowed(records: Sequence[Record]) -> str:
    """What is to be said where no record follows its command, or nothing."""
    if any(unrelated(r.u, r.y, r.sample_rate_hz) is None for r in records):
        return ""
    return (
        "The output does not follow its command: these records tell nothing of the axis, nor of what its "
        "model lacks."
    )


def axis_words(base: Mapping[str, Estimate]) -> str:
    """Limits and resonances of the axis: the beginning of a sentence."""
    sides = [base[n] for n in ("saturation.lower", "saturation.upper") if n in base]
    limits = [e for e in sides if 0 < e.sd < WELL_KNOWN * abs(e.mean)]
    parts = []
    if sides and not limits:
        parts.append("reaches no limit in these records")
    if limits:
        parts.append(f"follows commands up to {_numbers([e.mean for e in limits])} {limits[0].unit}")
    modes = [e.mean for n, e in base.items() if n.startswith("mode") and n.endswith("frequency_hz")]
    if modes:
        parts.append(f"swings at {_numbers(modes)} Hz")
    return "The axis " + (" and ".join(parts) if parts else "follows its command")


def _numbers(values: Sequence[float]) -> str:
    return listed([plainly(value) for value in values])
