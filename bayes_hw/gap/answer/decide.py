"""From explanations to an answer: which effects are said to be present, and how probable each is.

Evidences of models that are all a little wrong polarise, so they are tempered. What the decision rests on is
put into numbers here (`claims_of`, `remains_of`) and judged in `judgement`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.judgement import Claim, Judgement, Labels, Remains, choose_labels, judge
from bayes_hw.gap.criticism.block_functions import with_floor
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic, is_in_the_scatter
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.fit.explanation import CHAOS_MARGIN, Explanation, best_of_each, is_far_ahead
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.search.attribute import Attribution

MOST_LABELS = 2


@dataclass(frozen=True)
class Decision:
    """Labels said to be present, the explanation that goes with them, probabilities, what is left.

    `blocks` is the probability that a cause nobody named enters at each.
    """

    answer: Labels
    explanation: Explanation
    probability: Mapping[str, float]
    leftovers: tuple[ResidualDiagnostic, ...]
    sets: Mapping[Labels, float]
    blocks: Mapping[str, float]


def best_of_sets(attribution: Attribution) -> dict[Labels, Explanation]:
    """The best explanation of every set of labels."""
    return _best_of_sets(attribution.explanations)


def _best_of_sets(explanations: Sequence[Explanation]) -> dict[Labels, Explanation]:
    """The same of explanations in any order.

    Lost motion counts only where the effect is far ahead: noise of its own explains as much. Sets of
    more than MOST_LABELS are not judged.
    """
    ahead = is_far_ahead(explanations)
    few = (e for e in explanations if len(e.labels) <= MOST_LABELS)
    return best_of_each((e for e in few if ahead or not e.chaotic_response), lambda e: e.labels)


def score(explanation: Explanation, nominal_sigma: float, calibration: Calibration) -> float:
    """Log-evidence with what is known of the encoder's noise."""
    if not nominal_sigma > 0:
        return explanation.log_evidence
    off = np.log(explanation.encoder_sigma / nominal_sigma) / calibration.sigma_log_sd
    return float(explanation.log_evidence - min(0.5 * off**2, calibration.largest_penalty))


def claims_of(
    best: Mapping[Labels, Explanation], nominal_sigma: float, calibration: Calibration
) -> dict[Labels, Claim]:
    """What speaks for every set of labels; `best` as `best_of_sets` gives it."""
    scores = {labels: score(e, nominal_sigma, calibration) for labels, e in best.items()}
    return {
        labels: _claim_of_pair(best, scores, labels) if len(labels) == 2 else Claim(scores[labels])
        for labels in best
    }


def choose(
    attribution: Attribution, nominal_sigma: float, calibration: Calibration
) -> tuple[Explanation, dict[Labels, float]]:
    """The explanation to go with, and the tempered log-odds of every set of labels."""
    return _choice(best_of_sets(attribution), nominal_sigma, calibration)


def chosen_among(
    explanations: Sequence[Explanation], nominal_sigma: float, calibration: Calibration
) -> Explanation:
    """The explanation to go with if `explanations`, the base model's one of them, were all."""
    return _choice(_best_of_sets(explanations), nominal_sigma, calibration)[0]


def _choice(
    best: Mapping[Labels, Explanation], nominal_sigma: float, calibration: Calibration
) -> tuple[Explanation, dict[Labels, float]]:
    chosen, scores = choose_labels(claims_of(best, nominal_sigma, calibration), calibration)
    return best[chosen], scores


def _claim_of_pair(
    best: Mapping[Labels, Explanation], scores: Mapping[Labels, float], labels: Labels
) -> Claim:
    """What both effects of a pair must reach against the pair without the one or the other.

    How much error an effect removes says nothing where base parameters far from the nominal model had made up
    for it, or where the motion is chaotic: then evidence alone counts, and small changes make much of it.
    """
    pair = best[labels]
    alone = [best.get((label,), best[()]) for label in labels]
    strain_tells = pair.at_odds_with_prior and not all(reference.at_odds_with_prior for reference in alone)
    untimely = pair.stochastic is not None and pair.stochastic.cause.untimely
    possible = not (pair.cannot_be_predicted and (strain_tells or untimely))
    demands: list[tuple[str, float]] = []
    for label, reference in zip(labels, alone, strict=True):
        gain = scores[labels] - scores[reference.labels]
        if ROUNDING in labels:
            if label != ROUNDING:
                continue
        else:
            demands.append(("pair_gain", float(gain)))
        if pair.cannot_be_predicted:
            possible = possible and bool(gain >= CHAOS_MARGIN)
            continue
        if pair.stochastic is not None and pair.stochastic.label != label:
            if pair.stochastic.size is not None:
                demands.append(("slow_pair_size", float(pair.stochastic.size / pair.encoder_sigma)))
            continue
        if reference.drifts and pair.drifts:
            samples = sum(map(len, pair.fit.residuals))
            demands.append(("slow_pair_share", float(np.sqrt(max(2 * gain / samples, 0.0)))))
            continue
        removed = reference.fit.rmse**2 - pair.fit.rmse**2
        made_up_for = reference.at_odds_with_prior and not pair.at_odds_with_prior
        if not made_up_for:
            size = float(np.sqrt(max(removed, 0.0)) / pair.encoder_sigma)
            demands += [("pair_size", size), ("pair_share", size / max(_gap(best[()], pair), 1e-300))]
    return Claim(scores[labels], possible, tuple(demands))


def _gap(base: Explanation, explanation: Explanation) -> float:
    """Root mean square of what the base model lacks, in units of the noise that an explanation finds."""
    sigma = max(explanation.encoder_sigma, 1e-300)
    return float(np.sqrt(max(base.fit.rmse**2 - sigma**2, 0.0)) / sigma)


def remains_of(
    base: Explanation,
    explanation: Explanation,
    left: Sequence[ResidualDiagnostic],
    negative_log_p: Mapping[str, float],
    far_ahead: bool = False,
) -> Remains:
    """What an explanation leaves, and what may be expected of it; `negative_log_p` are those of the blocks.

    Where a chaotic effect is `far_ahead` (`is_far_ahead`), what it leaves is no sign of another cause.
    """
    sigma = max(explanation.encoder_sigma, 1e-300)
    return Remains(
        tuple(left),
        gap=_gap(base, explanation),
        bent_disturbance=float(explanation.bent_disturbance / sigma),
        loose=explanation.display is not None or explanation.chaotic,
        drifts=explanation.drifts,
        excused=far_ahead and explanation.chaotic,
        blocks=with_floor(negative_log_p, is_in_the_scatter(left)),
        named=blocks_to_check(explanation),
        predicted=_predicted(base, explanation, negative_log_p),
        unheard_of=bool(explanation.unheard_of),
    )


def _predicted(base: Explanation, explanation: Explanation, negative_log_p: Mapping[str, float]) -> float:
    """What functions of command, motion and time take of one chaotic effect's evidence over the base.

    Little of backlash that cannot be predicted, much of a spring that passes for it. Nothing is said of two
    effects, one of which may be followed.
    """
    gain = explanation.log_evidence - base.log_evidence
    if len(explanation.labels) != 1 or not explanation.cannot_be_predicted or not gain > 0:
        return 0.0
    return float(max(negative_log_p.values()) / gain)


def blocks_to_check(explanation: Explanation) -> tuple[str, ...]:
    """Blocks of the effects of an explanation, none where functions that name no cause do not tell them.

    Those were tried on Hammerstein-Wiener axes and the effects that come with the program: one of another
    package may enter at several blocks. No function of command, motion or slow time takes what is random,
    gusts, jitter or glitches, nor what only a motion shows that cannot be predicted.
    """
    known = LABEL_BLOCKS.keys() >= set(explanation.labels)
    on_axis = explanation.fit.hypothesis.builder.has_drive_train
    shown = explanation.cause_of_noise is None and not explanation.cannot_be_predicted
    return tuple(LABEL_BLOCKS[label] for label in explanation.labels) if known and on_axis and shown else ()


def decide(
    explanation: Explanation,
    scores: Mapping[Labels, float],
    remains: Remains,
    labels: Sequence[str],
    calibration: Calibration,
) -> Decision:
    """The answer that goes with the chosen explanation."""
    found: Judgement = judge(explanation.labels, scores, remains, labels, calibration)
    return Decision(found.answer, explanation, found.probability, remains.leftovers, found.sets, found.blocks)
