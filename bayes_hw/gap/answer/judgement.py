"""From numbers to an answer: which sets of labels are claimed, which is chosen, how probable each label is.

A decision sees no fit, only what fits have come to, so that it can be made again with other constants, and
the constants be fitted on cases whose truth is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.criticism.block_functions import FLOOR
from bayes_hw.gap.criticism.residual_diagnostics import GUSTS, LINE, ResidualDiagnostic
from bayes_hw.gap.noise.random_cause import ROUNDING

NONE, OTHER = "none", "other"
FUNCTION = "function"
"""Kinds of leftovers that are functions of command, motion or time begin with it."""

SLOW_TORQUE = "function at disturbance"

Labels = tuple[str, ...]


@dataclass(frozen=True)
class Claim:
    """What speaks for a set of labels: its log-evidence with what is known of the noise, and for two labels
    whether they are `possible` together and what both must reach to have earned their places, as names of
    constants with the values found."""

    score: float
    possible: bool = True
    demands: tuple[tuple[str, float], ...] = ()

    def earned(self, calibration: Calibration) -> bool:
        """Whether every demand is met."""
        return self.possible and all(value >= getattr(calibration, name) for name, value in self.demands)


@dataclass(frozen=True)
class Remains:
    """What the chosen explanation leaves: `gap` of the base and `bent_disturbance` in units of the noise.

    `loose` where the effect itself cannot be followed sample by sample, `drifts` where slow noise is part of
    the explanation, `excused` where what chaotic motion far ahead of all else leaves is no other cause, but
    for a line in its spectrum: chaos has none. `blocks` is by block the negative_log_p, in nats, of what
    functions that name no cause take of the base's gap, `named` the blocks of the effects that explain it,
    none where that says nothing of them. `predicted` is, of one effect whose motion is said to be chaotic,
    what those functions take of its log-evidence over the base. `unheard_of` where an effect would need
    numbers that none of its kind has: it explains nothing then.
    """

    leftovers: tuple[ResidualDiagnostic, ...]
    gap: float = 0.0
    bent_disturbance: float = 0.0
    loose: bool = False
    drifts: bool = False
    excused: bool = False
    blocks: Mapping[str, float] = field(default_factory=dict)
    named: tuple[str, ...] = ()
    predicted: float = 0.0
    unheard_of: bool = False

    def probability_of_blocks(self, sharpness: float) -> dict[str, float]:
        """Of every block that the gap of the base enters there; odds are one plus a block's negative log
        p-value to the power `sharpness`."""
        odds = {block: (1 + value) ** sharpness for block, value in self.blocks.items()}
        total = sum(odds.values())
        return {block: value / total for block, value in odds.items()}

    def expected(self, calibration: Calibration) -> float:
        """What even a right explanation may leave, in units of the noise: shares of the gap of the base and
        of wind through a path that bends."""
        share = calibration.loose_share if self.loose else calibration.left_share
        return math.hypot(self.gap * share, calibration.bent_share * self.bent_disturbance)


@dataclass(frozen=True)
class Judgement:
    """Labels said to be present, the probability of every label, of every set, and of every block that a
    cause nobody named enters there."""

    answer: Labels
    probability: Mapping[str, float]
    sets: Mapping[Labels, float]
    blocks: Mapping[str, float]


def choose_labels(
    claims: Mapping[Labels, Claim], calibration: Calibration
) -> tuple[Labels, dict[Labels, float]]:
    """The set of labels to go with, and the scores of all: minus infinity for pairs that are not earned."""
    scores = {labels: claim.score for labels, claim in claims.items()}
    chosen: Labels = ()
    rounded: Labels = (ROUNDING,)
    if rounded in claims:
        chosen = rounded
    singles = [labels for labels in claims if len(labels) == 1]
    if singles and not chosen:
        top = max(singles, key=lambda labels: scores[labels])
        if scores[top] > scores[()] + calibration.single_gain:
            chosen = top
    pairs = []
    for labels in [key for key in claims if len(key) == 2]:
        fits_lattice = rounded != chosen or rounded[0] in labels
        if fits_lattice and claims[labels].earned(calibration):
            pairs.append(labels)
        else:
            scores[labels] = -math.inf
    if pairs:
        best_pair = max(pairs, key=lambda labels: scores[labels])
        if scores[best_pair] > scores[chosen] + calibration.pair_gain:
            chosen = best_pair
    return chosen, scores


def probability_of_other(remains: Remains, calibration: Calibration) -> float:
    """Odds that what is left is structure, larger than is expected beside the noise, that the cause is in a
    block where nothing that is named enters, every block having the sensor's floor, or that what is called
    chaos follows the command after all. An effect of numbers that are unheard of is another cause for
    certain.

    A small remainder of a wrong explanation is told by a function of small p-value, since right ones that can
    be followed sample by sample leave none. Slow noise, where the explanation `drifts`, takes up
    most of a wrong response: of what a free function of command or motion would explain, or gusts that follow
    them, less then counts. A free torque in time is what slow noise is itself.
    """
    if remains.unheard_of:
        return 1.0
    odds = -math.inf
    if remains.named:
        told = replace(remains, blocks={block: max(x, FLOOR) for block, x in remains.blocks.items()})
        probable = told.probability_of_blocks(calibration.named_sharpness)
        unlikely = calibration.named_block / max(probable[block] for block in remains.named)
        odds = calibration.left_sharpness * math.log(unlikely)
    if remains.predicted > 0:
        odds = max(
            odds, calibration.left_sharpness * math.log(remains.predicted / calibration.chaos_predicted)
        )
    size = math.hypot(calibration.left_size, remains.expected(calibration))
    for item in remains.leftovers:
        if item.negative_log_p <= 0 or item.size <= 0:
            continue
        hidden = remains.drifts and item.kind.startswith((FUNCTION, GUSTS)) and item.kind != SLOW_TORQUE
        even = calibration.slow_left_surprise if hidden else calibration.left_surprise
        odds = max(odds, _log_odds(item, even, size, calibration))
        if item.kind.startswith(FUNCTION) and not (remains.loose or remains.drifts):
            plain = calibration.plain_surprise, calibration.plain_size
            odds = max(odds, _log_odds(item, *plain, calibration))
    return 1 / (1 + math.exp(-min(max(odds, -30.0), 30.0)))


def _log_odds(item: ResidualDiagnostic, even: float, size: float, calibration: Calibration) -> float:
    """That what is left counts, even where it has just this negative log p-value or just this `size`."""
    by_p_value, by_size = math.log(item.negative_log_p / even), 2 * math.log(item.size / size)
    return calibration.left_sharpness * min(by_p_value, by_size)


def judge(
    chosen: Labels,
    scores: Mapping[Labels, float],
    remains: Remains,
    labels: Sequence[str],
    calibration: Calibration,
) -> Judgement:
    """The answer and the marginal probability of every label, of none and of other."""
    other = min(probability_of_other(remains, calibration), calibration.other_ceiling)
    if remains.excused and not remains.unheard_of:
        lines = tuple(item for item in remains.leftovers if item.kind == LINE)
        of_line = probability_of_other(replace(remains, leftovers=lines, loose=False), calibration)
        other = max(min(other, 1 - calibration.other_ceiling), min(of_line, calibration.other_ceiling))
    centre = scores[chosen] - calibration.handicap(chosen)
    weights = {}
    rounded = ROUNDING in chosen
    for key, value in scores.items():
        if rounded and ROUNDING not in key:
            continue
        behind = (value - calibration.handicap(key) - centre) / calibration.temperature
        weights[key] = math.exp(min(max(behind, -700.0), 0.0))
    total = sum(weights.values())
    sets = {key: (1 - other) * weight / total for key, weight in weights.items()}
    probability = {NONE: sets.get((), 0.0), OTHER: other}
    for label in labels:
        probability[label] = sum(weight for key, weight in sets.items() if label in key)
    floor = calibration.floor
    probability = {k: min(max(p, floor), 1 - floor) for k, p in probability.items()}
    answer = chosen
    if len(answer) > 1:
        probability = {
            k: min(p, calibration.pair_ceiling) if k in answer else p for k, p in probability.items()
        }
    if other > 0.5:
        answer = (OTHER,)
    return Judgement(answer, probability, sets, remains.probability_of_blocks(calibration.block_sharpness))
