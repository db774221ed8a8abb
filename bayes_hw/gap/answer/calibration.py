"""The constants of a decision: thresholds, and how evidences become probabilities."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files


@dataclass(frozen=True)
class Calibration:
    """The constants of a decision, those of `calibration.json`.

    `temperature` divides evidences; `single_gain` and `pair_gain` are the least gains in log-evidence for an
    effect to be named; `pair_size` the least error, in sigma, that the second effect must remove,
    `pair_share` the same as a share of the gap, since a wrong first effect leaves one to be taken, and
    `slow_pair_size` that a stochastic one must make, and `slow_pair_share` what a second effect must explain
    of innovations under slow noise, which plain errors do not tell; `left_surprise` (nats; of functions and
    gusts under slow noise `slow_left_surprise`) and `left_size` (units of the noise, joined by `left_share`
    of the gap) are the leftover at which "other" is even odds, `loose_share` in the place of `left_share`
    where the effect itself cannot be followed sample by sample (chaotic motion, repeated or rounded samples),
    `bent_share` of wind through a path that an effect bends; `plain_surprise` and `plain_size` are the same
    of a function where every sample can be followed, which a right explanation leaves nothing of, however
    large the gap; `named_block` the probability of the named effects' blocks, as functions that name no cause
    have it, at which "other" is even odds too, odds there being one plus a block's negative log p-value to
    the power `named_sharpness`; `block_sharpness` the same power where the probability of a block is stated;
    `chaos_predicted` the share of one chaotic effect's evidence at which "other" is even odds if functions of
    command and motion take it; `left_sharpness` how fast the odds change with the logarithms of that
    value, of that probability and of that share; `floor` the least doubt; `pair_ceiling` the largest
    probability of a label in an answer of two, `other_ceiling` that of "other", since a search can have
    missed the cause; `sigma_log_sd` how far a nominal noise may be off, in its logarithm, and
    `largest_penalty` the most that noise unlike it costs an explanation, in log-evidence; `largest_doubt` the
    logarithm of the noise that is left over the noise that is known, as far as it is believed where no
    explanation holds; `chaos_in_noise` the share by which the noise may be off beside a chaotic response,
    some of whose motion passes for it; `confusable_evidence` the tempered log-odds within which another label
    is left open; `small_share` what one label may leave of the base model's root mean square error where no
    noise is known, for a second not to be looked at; `failed_scale` how much farther the truth is from the
    best of the explanations that failed than they are from one another; `astray_share` is how often base
    parameters are not where an explanation's posterior has them, since it is not quite right, and
    `astray_scale` how much farther off they are then; `sure_enough` the probability of an answer by the drive
    train from which on it stands without being asked for through ports too, and at which "other" by the train
    and a name by ports are even odds.
    """

    temperature: float
    single_gain: float
    pair_gain: float
    pair_size: float
    pair_share: float
    slow_pair_size: float
    slow_pair_share: float
    left_surprise: float
    slow_left_surprise: float
    left_size: float
    left_share: float
    loose_share: float
    bent_share: float
    plain_surprise: float
    plain_size: float
    named_block: float
    named_sharpness: float
    block_sharpness: float
    chaos_predicted: float
    left_sharpness: float
    floor: float
    pair_ceiling: float
    other_ceiling: float
    sigma_log_sd: float
    largest_penalty: float
    largest_doubt: float
    chaos_in_noise: float
    confusable_evidence: float
    small_share: float
    failed_scale: float
    astray_share: float
    astray_scale: float
    sure_enough: float

    def handicap(self, labels: Sequence[str]) -> float:
        """What a set of labels must gain in log-evidence to be named."""
        return self.single_gain * (len(labels) > 0) + self.pair_gain * (len(labels) > 1)

    def with_posteriors_as_they_are(self) -> Calibration:
        """The same with none astray, which is fitted to what such posteriors miss."""
        return replace(self, astray_share=0.0)

    @classmethod
    def built_in(cls) -> Calibration:
        """The constants that come with the program."""
        text = files("bayes_hw.gap.answer").joinpath("calibration.json").read_text(encoding="utf-8")
        return cls(**json.loads(text))
