"""From the search's nats to an answer with probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.slow_noise import WALK, WIND
from bayes_hw.gap.joint.residuals.remainder import COLOURED_NATS, Remainder
from bayes_hw.gap.joint.search.joint_search import JointAnswer


@dataclass(frozen=True)
class JointEvidence:
    """Nats of every label of the fit after regrowth (`nats`), of the readings' faults (`reading_nats`), of
    every label's best explanation alone over the base (`rivals`) and of the fit over the base (`own`); the
    labels of the fit and what it leaves; the labels that were `followed` to the end of the search, whose
    nats are those of that end; for labels of an answer of several, by how many nats that leads with another
    one in the place of each (`stand_ins`); whether the fit, simulated, `follows_no_better` than the base."""

    nats: Mapping[str, float]
    reading_nats: Mapping[str, float]
    rivals: Mapping[str, float]
    own: float
    labels: tuple[str, ...]
    remainder: Remainder
    followed: tuple[str, ...] = ()
    cut_short: bool = False
    stand_ins: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    follows_no_better: bool = False

    @classmethod
    def of(cls, found: JointAnswer) -> JointEvidence:
        """Of a finished search."""
        return cls(
            dict(found.nats),
            dict(found.readings.nats),
            dict(found.rivals),
            found.fit.score - found.base.score,
            found.fit.labels,
            found.remainder,
            found.followed,
            found.cut_short,
            {label: dict(leads) for label, leads in found.stand_ins.items()},
            found.follows_no_better,
        )

    def to_dict(self) -> dict[str, Any]:
        """For a file; infinite nats, over what cannot be simulated at all, are the largest number."""
        return {
            **asdict(self),
            "nats": _bounded(self.nats),
            "rivals": _bounded(self.rivals),
            "own": float(np.clip(self.own, -LARGEST, LARGEST)),
            "stand_ins": {label: _bounded(leads) for label, leads in self.stand_ins.items()},
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> JointEvidence:
        """As `to_dict` gives it."""
        return cls(
            content["nats"],
            content["reading_nats"],
            content["rivals"],
            float(content["own"]),
            tuple(content["labels"]),
            Remainder(**content["remainder"]),
            tuple(content.get("followed", ())),
            bool(content.get("cut_short", False)),
            content.get("stand_ins", {}),
            bool(content.get("follows_no_better", False)),
        )


LARGEST = float(np.finfo(float).max)


def _bounded(nats: Mapping[str, float]) -> dict[str, float]:
    return {label: float(np.clip(each, -LARGEST, LARGEST)) for label, each in nats.items()}


LEAST_SHARE = 0.05
"""Of the probability of two labels: a rival that has less is not confusable with the other. Of all: an
explanation that has less has none of the draws."""

MOST_NAMED = 2
OTHER_CAUSE = {WIND: WALK, WALK: WIND}
"""Of slow noise."""

PART_OF_G = ("transport_delay", "unmodelled_mode")
"""Without a model they are no gap."""


@dataclass(frozen=True)
class JointDecision:
    """The answer, its probabilities, pairs that the records cannot tell apart."""

    answer: tuple[str, ...]
    probability: Mapping[str, float]
    confusable: tuple[tuple[str, str], ...]


def decide_jointly(found: JointAnswer) -> JointDecision:
    """The decision on a finished search from records alone."""
    return decide(JointEvidence.of(found))


def decide(
    found: JointEvidence,
    calibration: JointCalibration | None = None,
    part_of_g: Sequence[str] = PART_OF_G,
) -> JointDecision:
    """By the constants of `calibration` (built in unless given); with a given model nothing is
    `part_of_g`."""
    calibration = calibration or JointCalibration.built_in()
    evidence = {**found.nats, **found.reading_nats}
    evidence.pop(OTHER, None)
    remains = max(nats.get(OTHER, 0.0) for nats in (found.nats, found.reading_nats))
    if found.follows_no_better:
        # Corrected at every sample any law predicts the next one; of the axis is what moves as it does.
        remains = max([remains, *(evidence.pop(label) for label in found.nats if label in evidence)])
    # Errors of readings follow each other; a slow axis shows a staircase of any length, as it is commanded.
    theirs = np.inf if "encoder_quantization" in evidence else 0.0
    if max(found.remainder.commanded, found.remainder.refuted) > calibration.nats_refuting:
        # Wind and an angle that walks know nothing of what is commanded, and are normal.
        remains = max(remains, sum(evidence.pop(label, 0.0) for label in OTHER_CAUSE) - theirs)
    elif not found.nats:
        theirs += calibration.colour_of_jitter * evidence.get("timing_jitter", 0.0)
        coloured = found.remainder.coloured - theirs
        if coloured > COLOURED_NATS:
            remains = max(remains, coloured)
    # What the readings themselves show needs no model, so it comes first.
    order = sorted(evidence, key=lambda label: (label not in found.reading_nats, -evidence[label]))
    answer = tuple(order)[:MOST_NAMED]
    if remains > 0:
        asked = calibration.least_beside if OTHER in found.nats else 1.0
        certain = answer and evidence[answer[0]] > asked * remains
        answer = (answer[0], OTHER) if certain else (OTHER,)

    def probabilities(answer: tuple[str, ...]) -> dict[str, float]:
        return _probabilities(found, answer, evidence, remains, calibration, part_of_g)

    decision = _contested(found, answer, probabilities(answer), calibration)
    if answer[1:] == (OTHER,) and decision.probability[answer[0]] < probabilities(answer)[OTHER]:
        # Less certain than that something else has no name, or another, it is not the certain one of the two.
        return _contested(found, (OTHER,), probabilities((OTHER,)), calibration)
    return decision


def _contested(
    found: JointEvidence,
    answer: tuple[str, ...],
    probability: dict[str, float],
    calibration: JointCalibration,
) -> JointDecision:
    """An answer with the probability of every label, rivals having their share of it, and what is confusable
    with one of its own."""
    found_contests, confusable = contests(found, answer, calibration.nats_as_good), []
    for named in dict.fromkeys(named for named, _, _ in found_contests):
        odds = {named: 1.0}
        for rival, lead in [(rival, lead) for one, rival, lead in found_contests if one == named]:
            causes = OTHER_CAUSE.get(named) == rival
            odds[rival] = calibration.odds(lead, found.own, causes)
            if lead < calibration.nats_as_good and odds[rival] / (1 + odds[rival]) > LEAST_SHARE:
                confusable.append((named, rival))
        together = min(sum(probability[label] for label in odds), 1.0)
        for label, odd in odds.items():
            probability[label] = odd / sum(odds.values()) * together
    return JointDecision(answer, probability, tuple(confusable))


def _probabilities(
    found: JointEvidence,
    answer: tuple[str, ...],
    evidence: Mapping[str, float],
    remains: float,
    calibration: JointCalibration,
    part_of_g: Sequence[str],
) -> dict[str, float]:
    floor = calibration.floor if len(evidence) < 2 else calibration.pair_floor
    hidden = found.remainder.share_of_a_cause
    of_effects = max(
        floor,
        calibration.coloured_floor * hidden,
        calibration.cut_short_floor if found.cut_short else 0.0,
    )
    certain = {
        label: calibration.sure(nats, of_effects if label in found.nats else floor)
        for label, nats in evidence.items()
    }
    doubts = [1 - p for p in certain.values()]
    if remains > 0:
        doubts.append(1 - calibration.sure(remains, calibration.other_floor))
    nothing = calibration.nothing([*evidence.values(), *([remains] if remains > 0 else [])])
    # What is no longer sure of a label that many nats speak for is another cause, not none.
    elsewhere = max(doubts, default=0.0) - nothing
    p_other = (1 - hidden) * calibration.other_unseen + hidden * calibration.other_coloured
    if remains > 0:
        p_other = calibration.sure(remains, calibration.other_floor)
    p_other = max(p_other, calibration.others_share * elsewhere)
    begun = {label: nats for label, nats in found.rivals.items() if label not in found.followed}
    if (
        answer
        and OTHER not in answer
        and found.nats
        and begun.get(OTHER, -np.inf) > calibration.near * found.own
    ):
        p_other = max(p_other, calibration.near_doubt)
        kept = 1 - calibration.near_doubt
        certain = {label: kept * p if label in found.nats else p for label, p in certain.items()}
    if answer == (OTHER,) and OTHER in found.labels and begun:
        named = max(begun, key=lambda label: begun[label] * (label != OTHER))
        if begun[named] > calibration.near * found.own:
            share = calibration.named_share
            certain[named], p_other = share * p_other, (1 - share) * p_other
    probability = dict.fromkeys(LABEL_BLOCKS, 0.0)
    probability.update(certain)
    if answer == (OTHER,):
        probability = {label: min(p, calibration.beside_other) for label, p in probability.items()}
    for label in part_of_g:
        probability[label] = 0.0
    if answer:
        none = nothing * (1 - p_other)
        rest = max((1 - calibration.others_share) * elsewhere, calibration.least * len(LABEL_BLOCKS))
    else:
        best = max(found.rivals.values(), default=-np.inf)
        none = 1 - p_other - calibration.none_doubt
        none -= calibration.nearly_found * float(np.exp(min(best, 0.0) / calibration.nats_nearly_found))
        if found.cut_short:
            p_other = max(p_other, calibration.cut_short_floor)
            none = min(none, 1 - p_other)
        none = max(none, calibration.least)
        rest = max(0.0, 1 - none - p_other)
    silent = [label for label in LABEL_BLOCKS if probability[label] == 0.0 and label not in part_of_g]
    for label in silent:
        probability[label] = rest / max(len(silent), 1)
    probability["none"], probability[OTHER] = none, p_other
    return probability


def contests(found: JointEvidence, answer: tuple[str, ...], as_good: float) -> list[tuple[str, str, float]]:
    """Labels of the answer, rivals in place of each, and the nats by which it leads; those that were not
    followed to the end are rivals within `as_good` of it, on either side."""
    leads: dict[tuple[str, str], float] = {}
    for named, rival, lead in (
        *_followed_rivals(found, answer, as_good),
        *_stand_ins(found, answer, as_good),
    ):
        leads[named, rival] = min(lead, leads.get((named, rival), np.inf))
    return [(named, rival, lead) for (named, rival), lead in leads.items()]


def _stand_ins(found: JointEvidence, answer: tuple[str, ...], as_good: float) -> list[tuple[str, str, float]]:
    """Beside another label of the answer, what is as good in the place of one."""
    return [
        (named, rival, lead)
        for named, leads in found.stand_ins.items()
        for rival, lead in leads.items()
        if named in answer and rival not in answer and lead < as_good
    ]


def _followed_rivals(
    found: JointEvidence, answer: tuple[str, ...], as_good: float
) -> list[tuple[str, str, float]]:
    """Of effects, rivals that were followed to the end, and beside a single one those whose own best
    explanation is as good: one that is far better and is not at the end did not stand. Causes of the noise
    are rivals of each other."""
    named = next((label for label in (*found.followed, *found.labels) if label in found.nats), None)
    if named is None or named not in answer:
        return []
    own = found.own if named in found.followed else max(found.rivals.get(named, 0.0), found.own)
    alone = len(found.labels) == 1 and len(answer) == 1
    rivals = {
        label: nats
        for label, nats in found.rivals.items()
        if label not in (named, *found.labels)
        and nats > 0
        and (label in found.followed or (alone and label != OTHER and abs(own - nats) < as_good))
    }
    caused = {label: OTHER_CAUSE[label] for label in rivals if OTHER_CAUSE.get(label) in found.labels}
    instead_of = {label: caused.get(label, named) for label in rivals}
    return [(instead_of[x], x, own - nats) for x, nats in rivals.items() if instead_of[x] in answer]


def explaining(found: JointAnswer, decision: JointDecision) -> JointFit:
    """The fit that an answer rests on: that of the search, without its effects where the answer is `other`
    and nothing in it stands for what has no name, or where it follows the records no better than without."""
    if found.follows_no_better:
        return found.base
    unnamed = decision.answer == (OTHER,) and found.fit.labels and OTHER not in found.fit.labels
    return found.base if unnamed and found.fit.without_name is None else found.fit


def rivals_of(
    found: JointAnswer, decision: JointDecision, calibration: JointCalibration
) -> list[tuple[JointFit, float]]:
    """Explanations beside the answer's, each with its probability: those that were followed to the end, and
    the base where the answer is `other` and a law stands for what has no name. That such a law follows the
    records makes it no law of the axis, whose limits, gap and modes it moves while it does."""
    followed = {label: decision.probability[label] for label in found.followed}
    total = max(sum(followed.values()), 1e-300)
    rivals = [
        (found.ends[label], share / total)
        for label, share in followed.items()
        if label not in found.fit.labels and label not in decision.answer
    ]
    if decision.answer == (OTHER,) and explaining(found, decision) is not found.base:
        left = 1 - sum(share for _, share in rivals)
        rivals.append((found.base, calibration.unnamed_base * left))
    return [(fit, share) for fit, share in rivals if share >= LEAST_SHARE]
