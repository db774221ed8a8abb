"""A case as a question: the base model to be fitted, the effects to be tried, the labels to be judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.repeats import repeated_floor
from bayes_hw.gap.case.scale import axis_scale
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.effects.any_simulator import STOCHASTIC_ON_OUTPUT, effects_for
from bayes_hw.gap.effects.catalogue import catalogue
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.fit.fit import first_sigma
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.simulate.builder import Builder
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder, inner_settings, simulator_scale
from bayes_hw.identify.holes import masks_of

UNKNOWN_NOISE_SHARE = 1e-3
"""Of the travel: the noise assumed to start with where the model names none."""


@dataclass(frozen=True, eq=False)
class Question:
    """The base hypothesis, the records (samples,) measured, the effects to try, every label in question, and
    the noise that the simulator names (output units; not positive where it names none)."""

    base: Hypothesis
    measured: list[FloatArray]
    effects: tuple[Effect, ...]
    labels: list[str]
    nominal_sigma: float

    @property
    def noise_is_known(self) -> bool:
        return self.nominal_sigma > 0


def question(case: Case | SimulatorCase, without: frozenset[str]) -> Question:
    """That of a case, the labels in `without` left out of the catalogue."""
    nominal = case.model.noise_sigma
    travel = max(float(np.ptp(record.y)) for record in case.train)
    floor = repeated_floor(case.train)
    sigma = nominal if nominal > 0 else min(floor, UNKNOWN_NOISE_SHARE * travel)
    inputs, measured = case.inputs, [record.y for record in case.train]
    masks = masks_of(case.train)
    unread = None if masks is None else tuple(~mask for mask in masks)
    free = tuple(number for number, record in enumerate(case.train) if record.has_free_level)
    builder: Builder
    if isinstance(case, Case):
        builder = chains = ChainBuilder(case.model)
        train = chains.train(chains.axis.nominal)
        scale = axis_scale(case.model, case.train, sigma, train.stiffness)
        effects, known = catalogue(without), set(LABEL_BLOCKS)
    else:
        builder = SimulatorBuilder(case.model)
        scale = simulator_scale(case.model, case.train, sigma)
        if not nominal > 0:
            rough = Hypothesis(builder, scale, inputs, unread=unread, free_levels=free)
            sigma = floor if np.isfinite(floor) else first_sigma(rough, measured)
            scale = simulator_scale(case.model, case.train, sigma)
        effects, known = effects_for(scale, inner_settings(case.model), without), set(STOCHASTIC_ON_OUTPUT)
    known |= {effect.label for effect in effects}
    labels = [label for label in LABEL_BLOCKS if label in known - without]
    labels += sorted(known - without - set(labels))
    return Question(
        Hypothesis(builder, scale, inputs, unread=unread, free_levels=free),
        measured,
        effects,
        labels,
        nominal,
    )
