"""From evidences to an answer: which effects are said to be present, and how probable each is.

Evidences of models that are all a little wrong polarise, so they are tempered. The temperature and the
thresholds (`calibration.json`) were set by hand, with an eye on known cases, never on the case at hand. On
123 simulated cases (seeds 1500, 1600 and 1901) the temperature is that of the best log score of the
marginal probabilities, and no other constant, changed alone, betters that score by more than 4 %.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from bayes_hw.gap.attribute import Attribution
from bayes_hw.gap.explanation import CHAOS_MARGIN, Explanation, best_of_each, is_far_ahead
from bayes_hw.gap.leftover import GUSTS, Leftover
from bayes_hw.gap.stochastic import ROUNDING

NONE, OTHER = "none", "other"
SLOW_TORQUE = "function at disturbance"


@dataclass(frozen=True)
class Calibration:
    """The constants of a decision, those of `calibration.json`.

    `temperature` divides evidences; `single_gain` and `pair_gain` are the least gains in log-evidence for
    an effect to be named; `pair_size` the least error, in sigma, that the second effect must remove, and
    `slow_pair_size` that a stochastic one must make, and `slow_pair_share` what a second effect must
    explain of innovations under slow noise, which plain errors do not tell; `left_surprise` (nats; of
    functions and gusts under slow noise `slow_left_surprise`) and `left_size` (units of the noise, joined by
    `left_share` of the gap) are the leftover at which "other" is
    even odds, `loose_share` in the place of `left_share` where the effect itself cannot be followed
    sample by sample (chaotic motion, repeated or rounded samples), `bent_share` of wind through a path that
    an effect bends; `left_sharpness` how fast the odds
    change with the logarithm of the surprise; `floor` the least doubt; `pair_ceiling` the largest
    probability of a label in an answer of two, `other_ceiling` that of "other", since a search can have
    missed the cause; `sigma_log_sd` how far a nominal noise may be off.
    """

    temperature: float
    single_gain: float
    pair_gain: float
    pair_size: float
    slow_pair_size: float
    slow_pair_share: float
    left_surprise: float
    slow_left_surprise: float
    left_size: float
    left_share: float
    loose_share: float
    bent_share: float
    left_sharpness: float
    floor: float
    pair_ceiling: float
    other_ceiling: float
    sigma_log_sd: float

    def handicap(self, labels: Sequence[str]) -> float:
        """What a set of labels must gain in log-evidence to be named."""
        return self.single_gain * (len(labels) > 0) + self.pair_gain * (len(labels) > 1)

    @classmethod
    def built_in(cls) -> Calibration:
        """The constants that come with the program."""
        text = files("bayes_hw.gap").joinpath("calibration.json").read_text(encoding="utf-8")
        return cls(**json.loads(text))


@dataclass(frozen=True)
class Decision:
    """Labels said to be present, the explanation that goes with them, probabilities, what is left."""

    answer: tuple[str, ...]
    explanation: Explanation
    probability: Mapping[str, float]
    leftovers: tuple[Leftover, ...]
    sets: Mapping[tuple[str, ...], float]


def best_of_sets(attribution: Attribution) -> dict[tuple[str, ...], Explanation]:
    """The best explanation of every set of labels.

    Lost motion counts only where the effect is far ahead: noise of its own explains as much.
    """
    ahead = is_far_ahead(attribution.explanations)
    counted = (e for e in attribution.explanations if ahead or not e.lost_motion)
    return best_of_each(counted, lambda e: e.labels)


def score(explanation: Explanation, nominal_sigma: float, calibration: Calibration) -> float:
    """Log-evidence with what is known of the encoder's noise."""
    if not nominal_sigma > 0:
        return explanation.log_evidence
    off = np.log(explanation.encoder_sigma / nominal_sigma) / calibration.sigma_log_sd
    return explanation.log_evidence - 0.5 * float(min(off**2, 400.0))


def choose(
    attribution: Attribution, nominal_sigma: float, calibration: Calibration
) -> tuple[Explanation, dict[tuple[str, ...], float]]:
    """The explanation to go with, and the tempered log-odds of every set of labels."""
    best = best_of_sets(attribution)
    scores = {labels: score(e, nominal_sigma, calibration) for labels, e in best.items()}
    chosen: tuple[str, ...] = ()
    rounded: tuple[str, ...] = (ROUNDING,)
    if rounded in best:
        chosen = rounded
    singles = [labels for labels in best if len(labels) == 1]
    if singles and not chosen:
        top = max(singles, key=lambda labels: scores[labels])
        if scores[top] > scores[()] + calibration.single_gain:
            chosen = top
    pairs = []
    for labels in [key for key in best if len(key) == 2]:
        fits_lattice = rounded != chosen or rounded[0] in labels
        if fits_lattice and _earned(best, scores, labels, calibration):
            pairs.append(labels)
        else:
            scores[labels] = -np.inf
    if pairs:
        best_pair = max(pairs, key=lambda labels: scores[labels])
        if scores[best_pair] > scores[chosen] + calibration.pair_gain:
            chosen = best_pair
    return best[chosen], scores


def _earned(
    best: Mapping[tuple[str, ...], Explanation],
    scores: Mapping[tuple[str, ...], float],
    labels: tuple[str, ...],
    calibration: Calibration,
) -> bool:
    """Whether both effects of a pair earn their place against the pair without the one or the other.

    How much error an effect removes says nothing where base parameters far from the nominal model had made up
    for it, or where the motion is chaotic: then evidence alone counts, and small changes make much of it.
    """
    pair = best[labels]
    alone = [best.get((label,), best[()]) for label in labels]
    strain_tells = pair.strained and not all(reference.strained for reference in alone)
    jitters = pair.stochastic is not None and pair.stochastic.label == "timing_jitter"
    if pair.chaotic and (strain_tells or jitters):
        return False
    for label, reference in zip(labels, alone, strict=True):
        if ROUNDING in labels:
            if label != ROUNDING:
                continue
        elif scores[labels] < scores[reference.labels] + calibration.pair_gain:
            return False
        if pair.chaotic:
            if scores[labels] < scores[reference.labels] + CHAOS_MARGIN:
                return False
            continue
        if pair.stochastic is not None and pair.stochastic.label != label:
            least = calibration.slow_pair_size * pair.encoder_sigma
            if pair.stochastic.size is not None and pair.stochastic.size < least:
                return False
            continue
        if _drifts(reference) and _drifts(pair):
            gain, samples = scores[labels] - scores[reference.labels], sum(map(len, pair.fit.residuals))
            if 2 * gain / samples < calibration.slow_pair_share**2:
                return False
            continue
        removed = reference.fit.rmse**2 - pair.fit.rmse**2
        made_up_for = reference.strained and not pair.strained
        if not made_up_for and removed < (calibration.pair_size * pair.encoder_sigma) ** 2:
            return False
    return True


def _drifts(explanation: Explanation) -> bool:
    """Whether slow noise may hold motion that a response would otherwise have to follow."""
    return explanation.stochastic is not None and explanation.stochastic.size is not None


def probability_of_other(
    left: Sequence[Leftover], expected: float, calibration: Calibration, drifts: bool = False
) -> float:
    """Odds that what is left is structure, larger than is `expected` beside the noise (both in sigma).

    Slow noise, where the explanation `drifts`, takes up most of a wrong response: of what a free function of
    command or motion would explain, or gusts that follow them, less then counts. A free torque in time is
    what slow noise is itself.
    """
    odds = -np.inf
    size = np.hypot(calibration.left_size, expected)
    for item in left:
        if item.surprise <= 0 or item.size <= 0:
            continue
        hidden = drifts and item.kind.startswith(("function", GUSTS)) and item.kind != SLOW_TORQUE
        even = calibration.slow_left_surprise if hidden else calibration.left_surprise
        by_surprise = calibration.left_sharpness * np.log(item.surprise / even)
        by_size = 2 * calibration.left_sharpness * np.log(item.size / size)
        odds = max(odds, min(by_surprise, by_size))
    return float(1 / (1 + np.exp(-np.clip(odds, -30, 30))))


def expected_left(base: Explanation, explanation: Explanation, calibration: Calibration) -> float:
    """What even a right explanation may leave, in units of the noise: shares of the gap of the base and of
    wind through a path that bends."""
    sigma = max(explanation.encoder_sigma, 1e-300)
    gap = float(np.sqrt(max(base.fit.rmse**2 - sigma**2, 0.0))) / sigma
    loose = explanation.display is not None or explanation.chaotic
    share = calibration.loose_share if loose else calibration.left_share
    return float(np.hypot(gap * share, calibration.bent_share * explanation.bent_gusts / sigma))


def decide(
    explanation: Explanation,
    scores: Mapping[tuple[str, ...], float],
    left: Sequence[Leftover],
    expected: float,
    labels: Sequence[str],
    calibration: Calibration,
    far_ahead: bool = False,
) -> Decision:
    """The answer and the marginal probability of every label, of none and of other.

    `expected` is what the explanation may leave (`expected_left`). Where a chaotic effect is `far_ahead`
    (`is_far_ahead`), what it leaves is no sign of another cause.
    """
    other = min(
        probability_of_other(left, expected, calibration, _drifts(explanation)), calibration.other_ceiling
    )
    if far_ahead and explanation.chaotic:
        other = min(other, 1 - calibration.other_ceiling)
    centre = scores[explanation.labels] - calibration.handicap(explanation.labels)
    weights = {}
    rounded = ROUNDING in explanation.labels
    for key, value in scores.items():
        if rounded and ROUNDING not in key:
            continue
        weights[key] = float(
            np.exp(np.clip((value - calibration.handicap(key) - centre) / calibration.temperature, -700, 0.0))
        )
    total = sum(weights.values())
    sets = {key: (1 - other) * weight / total for key, weight in weights.items()}
    probability = {NONE: sets.get((), 0.0), OTHER: other}
    for label in labels:
        probability[label] = sum(weight for key, weight in sets.items() if label in key)
    probability = {
        k: float(np.clip(p, calibration.floor, 1 - calibration.floor)) for k, p in probability.items()
    }
    answer: tuple[str, ...] = explanation.labels
    if len(answer) > 1:
        probability = {
            k: min(p, calibration.pair_ceiling) if k in answer else p for k, p in probability.items()
        }
    if other > 0.5:
        answer = (OTHER,)
    return Decision(answer, explanation, probability, tuple(left), sets)
