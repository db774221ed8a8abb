"""From the search's nats to an answer with probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS
from bayes_hw.gap.joint.joint_calibration import JointCalibration
from bayes_hw.gap.joint.joint_evidence import JointEvidence
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.joint_search import JointAnswer

COLOURED_NATS = 60.0
"""By which an autoregression of higher order must beat one of the first for the noise to count as a cause."""

TORQUE_NATS = 40.0
AS_GOOD = 15.0
"""Nats within which another spectrum of the noise, or a rival label, explains the records as well."""

RHYTHM_NATS = 20.0
"""By which noise must change with the sample number to have a cause in the readings' electronics."""

GAUSSIAN = 0.6
"""Largest excess kurtosis of the innovations of wind or of an angle that walks: neither jumps."""

COARSE_RATIO = 1.5
"""Root mean square residual over innovations, beside a label, from which something else is said to remain."""

MOST_NAMED = 2
SMALL = 0.002
OTHERS_SHARE = 0.3
"""Of the doubt of a label that many nats speak for, what goes to causes without a name."""

NEAR = 0.7
"""Share of the answer's nats that a form without a name, not followed to the end, earns alone, from which
`other` is not ruled out; and one with a name, beside an answer without."""


PART_OF_G = ("transport_delay", "unmodelled_mode")
"""Without a model they are no gap."""


@dataclass(frozen=True)
class JointDecision:
    """The answer, its probabilities, pairs that the records cannot tell apart."""

    answer: tuple[str, ...]
    probability: Mapping[str, float]
    confusable: tuple[tuple[str, str], ...]


def decide_jointly(found: JointAnswer, part_of_g: Sequence[str] = PART_OF_G) -> JointDecision:
    """The decision on a finished search; with a given model nothing is `part_of_g`."""
    return decide(JointEvidence.of(found), part_of_g=part_of_g)


def decide(
    found: JointEvidence,
    calibration: JointCalibration | None = None,
    part_of_g: Sequence[str] = PART_OF_G,
) -> JointDecision:
    """By the constants above, probabilities by those of `calibration` (built in unless given)."""
    calibration = calibration or JointCalibration.built_in()
    evidence = {**found.nats, **found.reading_nats}
    remains = evidence.pop(OTHER, 0.0)
    if found.remainder.rhythm > RHYTHM_NATS:
        # Readings that are worse at every m-th sample are no worse by speed, or not by that alone.
        evidence.pop("timing_jitter", None)
        remains = max(remains, found.remainder.rhythm)
    elif not evidence.keys() & {"encoder_quantization", "timing_jitter"}:
        cause, nats = cause_of_remainder(found)
        if cause == OTHER:
            remains = max(remains, nats)
        elif cause is not None:
            evidence.setdefault(cause, nats)
    # What the readings themselves show needs no model, so it comes first.
    order = sorted(evidence, key=lambda label: (label not in found.reading_nats, -evidence[label]))
    answer = tuple(order)[:MOST_NAMED]
    if remains > 0:
        certain = answer and (OTHER in found.nats or evidence[answer[0]] > remains)
        answer = (answer[0], OTHER) if certain else (OTHER,)
    probability = _probabilities(found, answer, evidence, remains, calibration, part_of_g)
    confusable = []
    for named, rival, lead in contests(found, answer):
        if lead < AS_GOOD:
            confusable.append((named, rival))
        together = probability[named] + probability[rival]
        probability[named] = together / (1 + float(np.exp(-lead / calibration.nats_between)))
        probability[rival] = together - probability[named]
    return JointDecision(answer, probability, tuple(confusable))


def cause_of_remainder(found: JointEvidence) -> tuple[str | None, float]:
    """Wind, an angle that walks, or something without a name in the noise that is left, with its nats."""
    left, spectrum = found.remainder, found.remainder.spectrum
    if found.nats and left.ratio < COARSE_RATIO:
        return None, 0.0
    closest = max(spectrum.autoregression, spectrum.first_order)
    plain = max(spectrum.first_order, spectrum.white)
    slow, walk = spectrum.torque - plain, spectrum.walk - plain
    if left.kurtosis < GAUSSIAN:
        if walk > TORQUE_NATS and spectrum.walk > max(closest - AS_GOOD, spectrum.torque):
            return "sensor_drift", walk
        if slow > TORQUE_NATS and spectrum.torque > closest - AS_GOOD:
            return "wind", slow
    coloured = spectrum.autoregression - spectrum.first_order
    strongest = max(coloured, slow, walk)
    return (OTHER, strongest) if left.order > 1 and strongest > COLOURED_NATS else (None, 0.0)


def _probabilities(
    found: JointEvidence,
    answer: tuple[str, ...],
    evidence: Mapping[str, float],
    remains: float,
    calibration: JointCalibration,
    part_of_g: Sequence[str],
) -> dict[str, float]:
    floor = calibration.floor if len(evidence) < 2 else calibration.pair_floor
    coloured = max(floor, calibration.coloured_floor) if found.remainder.order > 1 else floor
    certain = {
        label: calibration.sure(nats, coloured if label in found.nats else floor)
        for label, nats in evidence.items()
    }
    doubts = [1 - p for p in certain.values()]
    if remains > 0:
        doubts.append(1 - calibration.sure(remains, calibration.other_floor))
    nothing = calibration.nothing([*evidence.values(), *([remains] if remains > 0 else [])])
    # What is no longer sure of a label that many nats speak for is another cause, not none.
    elsewhere = max(doubts, default=0.0) - nothing
    p_other = calibration.other_coloured if found.remainder.order > 1 else calibration.other_unseen
    if remains > 0:
        p_other = calibration.sure(remains, calibration.other_floor)
    p_other = max(p_other, OTHERS_SHARE * elsewhere)
    begun = {label: nats for label, nats in found.rivals.items() if label not in found.followed}
    if answer and OTHER not in answer and found.nats and begun.get(OTHER, -np.inf) > NEAR * found.own:
        p_other = max(p_other, 0.3)
        certain = {label: 0.7 * p if label in found.nats else p for label, p in certain.items()}
    if answer == (OTHER,) and OTHER in found.labels and begun:
        named = max(begun, key=lambda label: begun[label] * (label != OTHER))
        if begun[named] > NEAR * found.own:
            certain[named], p_other = 0.25 * p_other, 0.75 * p_other
    probability = dict.fromkeys(LABEL_BLOCKS, 0.0)
    probability.update(certain)
    if answer == (OTHER,):
        probability = {label: min(p, 0.3) for label, p in probability.items()}
    for label in part_of_g:
        probability[label] = 0.0
    if answer:
        none = nothing * (1 - p_other)
        rest = max((1 - OTHERS_SHARE) * elsewhere, SMALL * len(LABEL_BLOCKS))
    else:
        best = max(found.rivals.values(), default=-np.inf)
        none = 1 - p_other - calibration.none_doubt
        none -= calibration.nearly_found * float(np.exp(min(best, 0.0) / calibration.nats_nearly_found))
        none = max(none, SMALL)
        rest = max(0.0, 1 - none - p_other)
    silent = [label for label in LABEL_BLOCKS if probability[label] == 0.0 and label not in part_of_g]
    for label in silent:
        probability[label] = rest / max(len(silent), 1)
    probability["none"], probability[OTHER] = none, p_other
    return probability


def contests(found: JointEvidence, answer: tuple[str, ...]) -> list[tuple[str, str, float]]:
    """Labels of the answer, rivals in place of each, and the nats by which it leads: of effects, rivals that
    were followed to the end, and beside a single one those whose own best explanation is as good; of slow
    noise, wind and a walk of nearly the same spectrum."""
    slow = ("wind", "sensor_drift")
    spectrum = found.remainder.spectrum
    if answer in ((slow[0],), (slow[1],)) and answer[0] not in found.nats:
        lead = abs(spectrum.torque - spectrum.walk)
        return [(answer[0], slow[answer[0] == slow[0]], lead)] if lead < AS_GOOD else []
    named = next((label for label in (*found.followed, *found.labels) if label in found.nats), None)
    if named is None or named not in answer:
        return []
    own = found.own if named in found.followed else max(found.rivals.get(named, 0.0), found.own)
    alone = len(found.labels) == 1 and len(answer) == 1
    return [
        (named, label, own - nats)
        for label, nats in found.rivals.items()
        if label not in found.labels
        and nats > 0
        and (label in found.followed or (alone and label != OTHER and nats > own - AS_GOOD))
    ]


def rivals_of(found: JointAnswer, decision: JointDecision) -> list[tuple[JointFit, float]]:
    """Explanations that were followed to the end beside the answer's, each with its probability."""
    followed = {label: decision.probability[label] for label in found.followed}
    total = max(sum(followed.values()), 1e-300)
    return [
        (found.ends[label], share / total)
        for label, share in followed.items()
        if label not in found.fit.labels and label not in decision.answer
    ]
