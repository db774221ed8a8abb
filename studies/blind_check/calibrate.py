"""Fitting the constants of decisions on simulated cases whose truth is known.

The score of a case is the logarithm of the probability stated for every label, present or absent, summed
over labels, and of one effect that of its block too, as functions that name no cause have it: proper, so
that best is what is calibrated. Every constant is held near the one that was set by hand by a normal prior
on its logarithm, since some are decided by few cases; of a ceiling it is the logarithm of the doubt that it
leaves. The score jumps where an answer changes, so the best is sought on a grid, one constant after another.

Constants that suit the answers of the cases at hand make those answers look surer than answers to other cases
are. Those that change no answer, only how sure it is, are therefore fitted once more, to judgements of cases
by constants that were fitted without them (stacking: Wolpert 1992, doi 10.1016/S0893-6080(05)80023-1).

A catalogue never holds every effect there is. Cases whose effect is struck from it count too, at a weight,
where answers are decided, and where blocks are, which functions find that know of no effect. Other doubts
they leave alone: those are of sets as they are drawn.

Once these alone are fitted, and once all constants. Of what scores within a standard error of the best, what
moves the fewest constants from where they were by hand is kept (Breiman and others, Classification and
Regression Trees, 1984, section 3.4.3).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.judgement import NONE, OTHER, Judgement
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.progress import Progress
from blind_check.ballot import WIDEST, Ballot

BY_HAND = Calibration(
    temperature=6.0,
    single_gain=14.0,
    pair_gain=12.0,
    pair_size=0.2,
    pair_share=0.15,
    slow_pair_size=0.5,
    slow_pair_share=0.1,
    left_surprise=18.0,
    slow_left_surprise=9.0,
    left_size=0.13,
    left_share=0.06,
    loose_share=0.35,
    bent_share=0.25,
    plain_surprise=40.0,
    plain_size=0.15,
    named_block=0.08,
    named_sharpness=2.2,
    block_sharpness=2.2,
    chaos_predicted=0.33,
    left_sharpness=2.0,
    floor=0.01,
    pair_ceiling=0.9,
    other_ceiling=0.9,
    sigma_log_sd=0.25,
    largest_penalty=200.0,
    largest_doubt=0.6,
    chaos_in_noise=0.1,
    confusable_evidence=6.0,
    small_share=0.2,
    failed_scale=2.0,
    astray_share=0.0,
    astray_scale=1.0,
    sure_enough=0.7,
)
"""Set with an eye on other simulated cases: the centre of the prior."""

HELD = (
    "sigma_log_sd",
    "largest_penalty",
    "largest_doubt",
    "chaos_in_noise",
    "confusable_evidence",
    "small_share",
    "failed_scale",
    "chaos_predicted",
    "astray_share",
    "astray_scale",
    "sure_enough",
)
"""The first two are part of the evidences that a ballot holds; no decision that it holds depends on the next
five, nor on the last three (of the first two of them see `tails`; `sure_enough` needs every case both by its
drive train and through ports). `chaos_predicted` is set on cases of springs and backlash, of which a
set of all kinds has few."""

DOUBTS = (
    "temperature",
    "left_sharpness",
    "floor",
    "pair_ceiling",
    "other_ceiling",
    "block_sharpness",
)
"""What changes no answer."""

WEIGHT_OF_STRUCK = 0.5
"""Of a case whose effect is struck from the catalogue."""

PRIOR_LOG_SD = 0.5
"""By about this factor each way a constant may be off that was set by hand."""

STEPS = np.linspace(-1.0, 1.0, 13)
"""Of the search, in units of the logarithm of WIDEST."""

CYCLES = 4
FOLDS = 5


@dataclass(frozen=True)
class CalibrationCase:
    """A ballot and the labels that are true of its case: of a case without an effect, `none`.

    `block` is where its effect enters, empty unless it is a single one of the catalogue, `struck` whether
    that was struck from the catalogue before the diagnosis: then `other` is true.
    """

    ballot: Ballot
    true: frozenset[str]
    block: str = ""
    struck: bool = False

    @classmethod
    def of(cls, ballot: Ballot, effects: Sequence[str]) -> CalibrationCase:
        """From the effects of the truth."""
        block = LABEL_BLOCKS.get(effects[0], "") if len(effects) == 1 else ""
        return cls(ballot, frozenset(effects) or frozenset({NONE}), block)

    @classmethod
    def without(cls, ballot: Ballot, label: str) -> CalibrationCase:
        """Of one effect whose label is struck from the catalogue."""
        return cls(ballot, frozenset({OTHER}), LABEL_BLOCKS[label], struck=True)

    @property
    def weight(self) -> float:
        """In the score of all cases."""
        return WEIGHT_OF_STRUCK if self.struck else 1.0

    def log_score(self, judgement: Judgement) -> float:
        """Sum over labels, and the block, of the logarithm of the probability stated for what is true."""
        of_true = [p if label in self.true else 1 - p for label, p in judgement.probability.items()]
        return sum(math.log(max(p, 1e-12)) for p in of_true) + self.log_score_of_block(judgement)

    def log_score_of_block(self, judgement: Judgement) -> float:
        """Logarithm of the probability stated for the block that is true, zero where none is."""
        return math.log(max(judgement.blocks.get(self.block, 1.0), 1e-12))

    def right(self, judgement: Judgement) -> bool:
        """Whether the answer is what the case carries."""
        return (frozenset(judgement.answer) or frozenset({NONE})) == self.true


@dataclass(frozen=True, eq=False)
class CalibrationFit:
    """Constants as fitted on `cases`, and judgements of them by hand, fitted, and fitted without their fold.

    Fitted are those of `names`. `profiles` holds the mean score against each constant, the others as fitted:
    (values, scores). `gains` are the mean gains over constants by hand, left out, with standard errors, by
    how many constants were fitted.
    """

    cases: tuple[CalibrationCase, ...]
    fitted: Calibration
    by_hand: tuple[Judgement, ...]
    as_fitted: tuple[Judgement, ...]
    left_out: tuple[Judgement, ...]
    profiles: Mapping[str, tuple[FloatArray, FloatArray]]
    names: tuple[str, ...]
    gains: Mapping[int, tuple[float, float]]

    def right(self, judgements: Sequence[Judgement]) -> BoolArray:
        """Whether every case is answered right, shape (cases,)."""
        pairs = zip(self.cases, judgements, strict=True)
        return np.array([case.right(judgement) for case, judgement in pairs])

    @property
    def gain(self) -> tuple[float, float]:
        """Mean gain in score by constants fitted without the case, over those by hand; its standard error."""
        return gain_over(self.cases, self.by_hand, self.left_out)

    @property
    def adopted(self) -> Calibration:
        """What goes with the program: as fitted where that predicts left-out cases better, else by hand."""
        return self.fitted if self.gain[0] > 0 else BY_HAND


def gain_over(
    cases: Sequence[CalibrationCase], before: Sequence[Judgement], after: Sequence[Judgement]
) -> tuple[float, float]:
    """Mean gain in the score of cases with the catalogue complete, and its standard error."""
    gains = np.array(
        [
            case.log_score(new) - case.log_score(old)
            for case, old, new in zip(cases, before, after, strict=True)
            if not case.struck
        ]
    )
    return float(gains.mean()), float(gains.std(ddof=1) / np.sqrt(len(gains)))


def calibrate(cases: Sequence[CalibrationCase], progress: Progress) -> CalibrationFit:
    """Fit the constants on all cases, and without each of the folds in turn; doubts on cases left out."""
    by_hand = tuple(case.ballot.judge(BY_HAND) for case in cases)
    candidates = (DOUBTS, names_fitted())
    with progress.task("fitting constants", len(candidates) * (FOLDS + 1)) as task:
        found = [_fit(cases, names, lambda: task.reach(task.done + 1)) for names in candidates]
    gains = {
        len(names): gain_over(cases, by_hand, left_out)
        for names, (_, left_out) in zip(candidates, found, strict=True)
    }
    best, error = max(gains.values())
    names, (fitted, left_out) = next(
        (names, its)
        for names, its in zip(candidates, found, strict=True)
        if gains[len(names)][0] >= best - error
    )
    return CalibrationFit(
        tuple(cases),
        fitted,
        by_hand,
        tuple(case.ballot.judge(fitted) for case in cases),
        left_out,
        {name: _profile(cases, fitted, name) for name in names_fitted()},
        names,
        gains,
    )


def _fit(
    cases: Sequence[CalibrationCase], names: Sequence[str], step: Callable[[], None]
) -> tuple[Calibration, tuple[Judgement, ...]]:
    """The constants of these `names` fitted, DOUBTS on cases left out, and judgements of cases by constants
    fitted without the case."""
    first = () if set(names) <= set(DOUBTS) else names
    folds = (np.arange(len(cases)) % FOLDS).tolist()
    answering = []
    for fold in range(FOLDS):
        rest = [case for case, its in zip(cases, folds, strict=True) if its != fold]
        answering.append(fit_constants(rest, first))
        step()
    constants = [answering[fold] for fold in folds]
    without = []
    for fold in range(FOLDS):
        others = [(c, k) for c, k, its in zip(cases, constants, folds, strict=True) if its != fold]
        without.append(replace(answering[fold], **fit_doubts(others)))
    fitted = replace(fit_constants(cases, first), **fit_doubts(list(zip(cases, constants, strict=True))))
    step()
    return fitted, tuple(case.ballot.judge(without[its]) for case, its in zip(cases, folds, strict=True))


def names_fitted() -> tuple[str, ...]:
    """The constants that a fit of all moves."""
    return tuple(field.name for field in fields(Calibration) if field.name not in HELD)


def fit_constants(cases: Sequence[CalibrationCase], names: Sequence[str]) -> Calibration:
    """The constants of largest score and prior density; `names` move, at most by a factor WIDEST."""
    steps = _best_steps(lambda trial: total_score(cases, moved(BY_HAND, trial)), names)
    return moved(BY_HAND, steps)


def fit_doubts(judged: Sequence[tuple[CalibrationCase, Calibration]]) -> dict[str, float]:
    """The same for DOUBTS alone, the others for every case its own; struck cases tell of blocks only.

    Cases come with constants that were fitted without them.
    """

    def doubts(steps: Mapping[str, float]) -> dict[str, float]:
        return {name: getattr(moved(BY_HAND, steps), name) for name in DOUBTS}

    def score(steps: Mapping[str, float]) -> float:
        chosen = doubts(steps)
        return sum(of_doubts(case, replace(constants, **chosen)) for case, constants in judged)

    def of_doubts(case: CalibrationCase, constants: Calibration) -> float:
        judgement = case.ballot.judge(constants)
        return case.weight * (case.log_score_of_block if case.struck else case.log_score)(judgement)

    return doubts(_best_steps(score, DOUBTS))


def _best_steps(score: Callable[[Mapping[str, float]], float], names: Sequence[str]) -> dict[str, float]:
    """How far to move the constants of these names, from those by hand, for the best of `score` and prior.

    A constant that leaves the score as it is at both ends of the search decides nothing and stays.
    """
    steps = dict.fromkeys(names, 0.0)
    value = score(steps)
    best = value + _log_prior(steps)
    for _ in range(CYCLES):
        begin = best
        for name in steps:
            trials = [{**steps, name: float(step)} for step in STEPS if step != steps[name]]
            trials = [trials[0], trials[-1], *trials[1:-1]]
            scores = [score(trial) for trial in trials[:2]]
            if all(end == value for end in scores):
                continue
            scores += [score(trial) for trial in trials[2:]]
            values = [s + _log_prior(trial) for s, trial in zip(scores, trials, strict=True)]
            if max(values) > best:
                at = int(np.argmax(values))
                best, value, steps = values[at], scores[at], trials[at]
        if best == begin:
            break
    return steps


def moved(calibration: Calibration, steps: Mapping[str, float]) -> Calibration:
    """Constants changed by `steps` in units of the logarithm of WIDEST; of a ceiling its doubt."""
    values = {}
    for name, step in steps.items():
        value, factor = getattr(calibration, name), WIDEST**step
        values[name] = 1 - (1 - value) * factor if name.endswith("_ceiling") else value * factor
    return replace(calibration, **values)


def total_score(cases: Sequence[CalibrationCase], calibration: Calibration) -> float:
    """The log scores of all cases together, by weight."""
    return sum(case.weight * case.log_score(case.ballot.judge(calibration)) for case in cases)


def _log_prior(steps: Mapping[str, float]) -> float:
    off = np.array(list(steps.values())) * np.log(WIDEST) / PRIOR_LOG_SD
    return -0.5 * float(off @ off)


def _profile(
    cases: Sequence[CalibrationCase], calibration: Calibration, name: str
) -> tuple[FloatArray, FloatArray]:
    trials = [moved(calibration, {name: float(step)}) for step in STEPS]
    weight = sum(case.weight for case in cases)
    means = [total_score(cases, trial) / weight for trial in trials]
    return np.array([getattr(trial, name) for trial in trials]), np.array(means)
