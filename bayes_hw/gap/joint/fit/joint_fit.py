"""One fitted explanation of the joint search, and the moves between explanations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.crew import each
from bayes_hw.gap.joint.fit.held_port import nats_lost
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale
from bayes_hw.gap.joint.noise.slow_noise import SlowNoise, SlowWhitener
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import Point, descend, evaluate, triangular_factor
from bayes_hw.identify.growth.levels import levels_of
from bayes_hw.identify.growth.search import Grown

LABEL_PRICE_NATS = 10.0
"""What a label must earn beyond its parameters: the catalogue's size and its forms' many starts."""

FULL_STEPS = 40
ROUND_STEPS, ROUNDS = 6, 7
"""Of descents that are raced against each other."""

FINE_STEPS = 4
"""Steps of G and its laws a sample."""


@dataclass(frozen=True, eq=False)
class JointFit:
    """A structure of G with effects, fitted together with the noise; `taken` counts the parameters of what
    was taken out of the records before."""

    response: JointResponse
    point: Point
    taken: int = 0

    @classmethod
    def of_grown(cls, grown: Grown, scale: JointScale) -> JointFit:
        """A cascade without any effect."""
        response = JointResponse(grown.structure, (), grown.response.records, scale)
        coordinates = response.coordinates(JointValues(grown.values))
        return cls(response, evaluate(response, coordinates))

    @property
    def values(self) -> JointValues:
        return self.response.values(self.point.coordinates)

    @property
    def structure(self) -> Structure:
        return self.response.structure

    @cached_property
    def errors(self) -> list[FloatArray]:
        """Measured less simulated output (samples,) of every record and less its level where that is free,
        unweighted, also of readings that tell nothing; NaN where nothing was measured."""
        if self.response.weights is None:
            return list(self.point.residuals)
        errors = self.response.errors(self.point.coordinates)
        return [e - level for e, level in zip(errors, self._levels_in(errors), strict=True)]

    @property
    def innovation_sigma(self) -> float:
        """Standard deviation of the innovations, output units where the weights are one."""
        return float(np.sqrt(self.point.sum_of_squares / self.point.samples))

    @property
    def levels(self) -> FloatArray:
        """Of every record (records,) as the fit tells them, zero where a level is known; of one in observer
        form as its simulation does, since readings that correct it tell no level."""
        if self.observer is not None:
            return self.without_observer().levels
        return self._levels_in(self.response.errors(self.point.coordinates))

    def _levels_in(self, errors: Sequence[FloatArray]) -> FloatArray:
        weighed = self.response.weighed(errors)
        return levels_of(weighed, self.response.level_shapes, self.point.whitener, self.point.masks)

    @property
    def labels(self) -> tuple[str, ...]:
        """Of the catalogue, the noise's cause first; known inputs and an observer, which come first among
        the effects, have none."""
        return (*self.added, *self.effect_labels)

    @property
    def effect_labels(self) -> tuple[str, ...]:
        """Of the template."""
        return tuple(effect.form.label for effect in self.response.template if not effect.form.column)

    @property
    def added(self) -> tuple[str, ...]:
        """Labels that are no effects of the template: the cause of the noise."""
        return () if self.response.cause is None else (self.response.cause.cause,)

    @property
    def without_name(self) -> str | None:
        """What a fit that explains readings by something without a name has in it; None for any other."""
        return None

    @property
    def of_a_given_model(self) -> bool:
        """Whether G is from a model that was given."""
        return False

    @property
    def dropped_then(self) -> str:
        """What is done when a label is dropped to see what it is worth."""
        return "G regrown"

    def said_of_g(self) -> list[str]:
        """Where G is from, and so what can be no gap of it."""
        order, delay = self.structure.order, self.structure.delay_samples
        said = [
            "no model was given: the structure of G, effects and noise were inferred together from the "
            f"records, G with {order} poles and {delay} samples of delay",
            "a longer delay or a further mode is part of such a G and cannot be a gap",
        ]
        if self.has_heavy_tails:
            said.append(
                "rare large errors, such as how a reversal goes within some samples, count for little: the "
                f"noise has heavy tails (Student t, {self.point.whitener.degrees_of_freedom:.3g} degrees of "
                "freedom)"
            )
        return said

    @property
    def known_count(self) -> int:
        """How many of the effects are known inputs, an observer counted; they come first."""
        return sum(bool(effect.form.column) for effect in self.response.template)

    @property
    def observer(self) -> int | None:
        """Where among the effects the observer stands, if the fit is in observer form."""
        laws = [effect.form.law for effect in self.response.template]
        return laws.index(K.INNOVATION) if K.INNOVATION in laws else None

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.added, *map(_named, self.response.template))

    @property
    def noise_order(self) -> int:
        """Of the noise without a cause; what a cause explains has the encoder's own left, of the first."""
        return self.point.whitener.order if self.response.cause is None else 1

    @property
    def has_heavy_tails(self) -> bool:
        """Whether its innovations are Student t and not normal."""
        return self.point.whitener.has_heavy_tails

    def factor(self) -> FloatArray:
        """Triangular factor (size + 1, size + 1) of the whitened derivatives and residual."""
        return triangular_factor(self.response, self.point)

    @property
    def free_count(self) -> int:
        """How many numbers were fitted; noise of a cause has few that are free."""
        cause = self.response.cause
        noise = self.point.whitener.order if cause is None else cause.parameters
        return self.response.size + noise + int(self.has_heavy_tails) + 1 + self.taken

    @property
    def log_likelihood(self) -> float:
        weights = self.response.weights
        lost = 0.0 if weights is None else sum(float(np.sum(np.log(w[np.isfinite(w)]))) for w in weights)
        return self.point.log_likelihood - lost

    @property
    def score(self) -> float:
        """Half of Schwarz's criterion in nats, larger is better, less the price of the labels and of the
        shape that noise of a cause has among those it may have, and what ports that are held lose."""
        labels, cause = len(self.response.template) + len(self.added), self.response.cause
        price = 0.5 * self.free_count * float(np.log(self.point.samples)) + LABEL_PRICE_NATS * labels
        price += 0.0 if cause is None else float(np.log(cause.choices))
        return self.log_likelihood - price - self._held_nats if np.isfinite(self.log_likelihood) else -np.inf

    @property
    def misread(self) -> list[int]:
        """Numbers of the effects that are what the loop misreads."""
        return [number for number, effect in enumerate(self.response.template) if effect.form.misread]

    @cached_property
    def _held_nats(self) -> float:
        return sum(nats_lost(self.response, self.point, number) for number in self.misread)

    def descended(self, steps: int = FULL_STEPS) -> Self:
        """After at most `steps` steps."""
        if self.point.converged:
            return self
        return replace(self, point=descend(self.response, self.point, steps))

    def on_records_of(self, other: Self) -> Self:
        """The same explanation of the records of another fit, under its weights, not descended; itself where
        they are its own."""
        response = other.response
        if response.records is self.response.records:
            return self
        return self.under(replace(self.response, records=response.records, weights=response.weights))

    def with_limits_reached(self) -> Self:
        """With limits that no command reaches where commands just do; none are told from no limit here."""
        return self

    def descended_under(self, order: int, steps: int) -> Self:
        """After at most `steps` steps under noise of a held order, free again at the end."""
        return replace(self, point=descend(self.response, self.point, steps, order))

    def moved(self, structure: Structure, values: JointValues, whitener: Whitener | None = None) -> Self:
        """At other values of another structure, not descended."""
        response = self._response_of(structure, values)
        return replace(
            self, response=response, point=evaluate(response, response.coordinates(values), whitener)
        )

    def _response_of(self, structure: Structure, values: JointValues) -> JointResponse:
        steps = self.response.steps if any(e.acts_within_sample for e in values.effects) else 1
        return replace(self.response, structure=structure, template=values.effects, steps=steps)

    def with_effect(self, form: Form, start: Sequence[float]) -> Self:
        """One more effect, of no strength yet."""
        return self.moved(self.structure, self._values_with(form, start), self.point.whitener)

    def effect_tangents(self, form: Form, start: Sequence[float]) -> list[FloatArray]:
        """For every record the derivatives (parameters, samples) of y by the coordinates of one more effect
        of no strength yet, over the weights."""
        values = self._values_with(form, start)
        return self._response_of(self.structure, values).effect_tangents(values)

    def _values_with(self, form: Form, start: Sequence[float]) -> JointValues:
        values, s = self.values, self.structure
        ports = Ports.none(s.real_poles, s.sections) if form.is_law else None
        effect = Effect(form, np.array(start, dtype=np.float64), ports)
        return JointValues(values.cascade, (*values.effects, effect))

    def with_known(self, form: Form, start: Sequence[float]) -> Self:
        """One more known input, of no strength yet, before the effects of the catalogue."""
        larger = self.with_effect(form, start)
        effects, count = larger.values.effects, self.known_count
        ordered = (*effects[:count], effects[-1], *effects[count:-1])
        values = JointValues(larger.values.cascade, ordered)
        return larger.moved(self.structure, values, self.point.whitener)

    def under(self, response: JointResponse, whitener: Whitener | None = None) -> Self:
        """The same coordinates under another response of the same structure, not descended; its noise is
        estimated there unless given."""
        return replace(self, response=response, point=evaluate(response, self.point.coordinates, whitener))

    def with_cause(self, cause: SlowNoise | None) -> Self:
        """With noise of a cause, or with a free autoregression again; not descended."""
        return self.under(replace(self.response, cause=cause))

    @property
    def slow(self) -> SlowWhitener | None:
        """The noise of a cause as it was fitted, where it has one."""
        return self.point.whitener if isinstance(self.point.whitener, SlowWhitener) else None

    def with_noise_kept(self) -> Self:
        """The noise of the cause begun where it is now, however its effects change."""
        cause = self.response.cause
        if cause is None or self.slow is None:
            return self
        return replace(self, response=replace(self.response, cause=replace(cause, begun=self.slow)))

    def without(self, label: str) -> Self:
        """One label fewer, not descended."""
        if label in self.added:
            return self.with_cause(None)
        values = self.values
        kept = tuple(e for e in values.effects if e.form.label != label)
        return self.moved(self.structure, JointValues(values.cascade, kept))

    def without_labels(self) -> Self:
        """Without any label, not descended; known inputs and an observer stay."""
        fit = self
        for label in self.labels:
            fit = fit.without(label)
        return fit

    def led_by(self, label: str) -> Self:
        """The same with the effect of `label` before the others that are no known input."""
        values = self.values
        known, rest = values.effects[: self.known_count], values.effects[self.known_count :]
        ordered = sorted(rest, key=lambda effect: effect.form.label != label)
        return self.moved(
            self.structure, JointValues(values.cascade, (*known, *ordered)), self.point.whitener
        )

    def without_observer(self) -> Self:
        """As a simulation that no reading corrects, not descended."""
        values = self.values
        kept = tuple(e for e in values.effects if e.form.law != K.INNOVATION)
        return self.moved(self.structure, JointValues(values.cascade, kept))

    def with_signal(self, number: int) -> Self:
        """An effect's law may look at the states of G too."""
        return self._with_ports(number, replace(self._ports_of(number), signal=True))

    def with_motion_of_g(self, number: int) -> Self:
        """An effect's law looks at the motion that G gives it, by a port that is free to bend it."""
        own, plain = self._ports_of(number), Ports.none(self.structure.real_poles, self.structure.sections)
        ports = replace(plain, real=own.real, sections=own.sections, direct=own.direct, signal=True)
        return self._with_ports(number, ports)

    def with_form(self, number: int, form: Form, start: Sequence[float]) -> Self:
        """An effect in another form of one law's family, its ports kept."""
        return self._with_effect_at(number, Effect(form, np.array(start), self.values.effects[number].ports))

    def _ports_of(self, number: int) -> Ports:
        ports = self.values.effects[number].ports
        assert ports is not None
        return ports

    def _with_ports(self, number: int, ports: Ports) -> Self:
        return self._with_effect_at(number, replace(self.values.effects[number], ports=ports))

    def _with_effect_at(self, number: int, effect: Effect) -> Self:
        """Another effect in the place of one, not descended."""
        values = self.values
        effects = (*values.effects[:number], effect, *values.effects[number + 1 :])
        return self.moved(self.structure, JointValues(values.cascade, effects), self.point.whitener)

    def finer(self) -> Self:
        """Laws and plays act FINE_STEPS times a sample: what sticks or turns within one does not wait for its
        end."""
        return self.under(replace(self.response, steps=FINE_STEPS), self.point.whitener)


AnyFit = TypeVar("AnyFit", bound=JointFit)


def raced(items: Sequence[AnyFit], least: float = -np.inf) -> list[AnyFit]:
    """Descended together, ROUND_STEPS at a time: one drops out where it would reach neither `least` nor the
    best score if it went on gaining to its last step what it gained in the last round."""
    running, found = list(items), list[AnyFit]()
    for left in range(ROUNDS - 1, -1, -1):
        further = list(zip(running, descended_each(running, ROUND_STEPS), strict=True))
        best = max([least, *(item.score for item in found), *(later.score for _, later in further)])
        running = []
        for before, item in further:
            reached = item.score + left * max(item.score - before.score, 0.0)
            if item.point.converged or left == 0 or reached < best:
                found.append(item)
            else:
                running.append(item)
    return found


def descended_each(items: Sequence[AnyFit], steps: int = FULL_STEPS) -> list[AnyFit]:
    """Every one after at most `steps` steps."""
    return each(lambda item: item.descended(steps), items)


def highest(items: Sequence[AnyFit]) -> AnyFit:
    """The one of the best score."""
    return max(items, key=lambda item: item.score)


def _named(effect: Effect) -> str:
    """The words for an effect: what its law looks at is a motion of its own where that is fitted."""
    if effect.form.law == K.INNOVATION:
        return "prediction-error form"
    return effect.form.full_name + (" over a motion of its own" if effect.looks_at_states else "")
