"""The next experiment when the question is which of two explanations holds."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.identifiability.effect_choice import ChoiceGain, Explanation, choice_gain
from bayes_hw.identifiability.excitation_families import Circumstances, families
from bayes_hw.identifiability.information_gain import Belief
from bayes_hw.identifiability.next_experiment import EVALUATIONS, STROKE_DRAWS, Candidate, Stroke, search
from bayes_hw.infer.posterior import Posterior
from bayes_hw.progress import Progress


def design_choice(
    first: Explanation,
    second: Explanation,
    posterior: Posterior,
    circumstances: Circumstances,
    rng: np.random.Generator,
    *,
    evaluations: int = EVALUATIONS,
    progress: Progress | None = None,
) -> tuple[tuple[Candidate, ChoiceGain], ...]:
    """The best command of every family for telling `first` from `second`, the most telling first.

    `posterior` is that of the base model: its draws keep the stroke, its mean noise is that of the records to
    come. Every command is judged with the same random numbers; the best are judged again with others.
    """
    progress = progress or Progress(quiet=True)
    belief_rng, final_rng, *family_rngs = rng.spawn(2 + 8)
    belief = Belief.of(posterior, STROKE_DRAWS, belief_rng)
    stroke = Stroke(belief, circumstances.limits)
    autoregression = belief.autoregression.mean(axis=1)
    innovation_sigma = float(belief.innovation_sigma.mean())

    def gain(u: FloatArray, noise_rng: np.random.Generator) -> ChoiceGain:
        return choice_gain(first, second, u, autoregression, innovation_sigma, noise_rng)

    def score(u: FloatArray) -> float:
        return gain(u, np.random.default_rng(0)).nats

    chosen = families(circumstances, posterior.axis.model.units.input)
    found = []
    with progress.task("families of commands", len(chosen)) as task:
        for done, (family, family_rng) in enumerate(zip(chosen, family_rngs, strict=False), start=1):
            best = search(family, stroke, score, family_rng, evaluations)
            if best is not None:
                found.append((best, gain(best.u, final_rng)))
            task.reach(done, family.label)
    if not found:
        raise InputError("stroke: no command of any family keeps the axis within it; widen --stroke")
    return tuple(sorted(found, key=lambda entry: -entry[1].nats))
