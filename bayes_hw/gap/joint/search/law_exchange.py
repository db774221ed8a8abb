"""The law of a torque exchanged for another one, in an explanation that is finished.

Laws that act through free ports come close to one another (a gap that opens and a friction that breaks loose
are the same curve over different signals), and a descent that began with one of them ends where its own start
led. What one has found, the others begin with: the new law looks at what the old one looked at, as nearly as
the states of G give it, enters where that entered, and is as strong as least squares makes it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from bayes_hw.gap.joint.fit.held_port import held_point
from bayes_hw.gap.joint.fit.joint_fit import AnyFit, JointFit, highest, raced
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.drive_forms import GIVEN_FORMS, OF_DEMAND
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import AS_READING
from bayes_hw.gap.joint.residuals.noise_screen import noise_screens
from bayes_hw.gap.joint.response.effect_paths import port_columns
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search.motion import Motion
from bayes_hw.time_budget import time_is_up

PERIODIC = (K.RIPPLE, K.MODULATED)
EXCHANGED: tuple[Form, ...] = tuple(
    form for form in GIVEN_FORMS if form.is_law and not form.further and form.law not in PERIODIC
)
"""Laws that are not periodic in position, those of the drive and its loop with them: a motion that a law
looks at may be what the loop asks for."""

ALIKE = 0.9
"""Correlation of the torques from which an exchange is tried, and how many are."""

MOST_TRIED = 4
FIRST_STEPS = 10

BY_STATES, COMMAND_LET_IN = 3.0, 0.6
"""Size of a law of the demand, in units of the limited command's speed, at which the command is next to
nothing in what it looks at, and the factor on it that lets more of the command in."""


@dataclass(frozen=True, eq=False)
class _Begun:
    """An exchange that is not descended, and the correlation of its torque with the old one."""

    alike: float
    fit: JointFit


def exchanged(fit: JointFit) -> list[JointFit]:
    """The fit with one of its laws exchanged for those that give nearly the same torque and look at a motion,
    each descended; none where it has no law of its own that is not periodic, or where time is up."""

    def begun(number: int) -> list[JointFit]:
        found = [one for one in exchanges(fit, number, EXCHANGED) if not looks_beside_position(one)]
        return found[:MOST_TRIED]

    return _for_every_law(fit, begun)


def begun_in_its_place(fit: JointFit, known: Sequence[JointFit]) -> list[JointFit]:
    """The fit with one of its laws left out, and laws of other labels begun over the motion that it looked
    at, each descended; any of those that are `known` may do better than a descent without that law.

    Laws that bend (a gap, a torque limit, a stiffening spring) are one another but for a part that is linear
    in what they look at, which a loop through G is as well: beside the G that was fitted with one of them
    another one is far off. Beside the G that was fitted without it the linear part of any is in G, and what a
    law promises there (`NoiseScreen`) is what it bends.
    """
    return _for_every_law(fit, lambda number: _over_the_motion(fit, number, known))


def misread(fit: AnyFit) -> list[AnyFit]:
    """The fit with a ripple of its own as an error of the speed that the loop reads, its port held: begun
    with the motion that the ripple looked at, and where that was its own with the one that G gives it, which
    a free port may have bent."""
    found = []
    for number, effect in enumerate(fit.values.effects):
        if effect.form in AS_READING:
            read = fit.with_form(number, AS_READING[effect.form], effect.values.tolist())
            for begun in (read, read.with_motion_of_g(number)) if effect.looks_at_states else (read,):
                held = held_point(begun.response, begun.point, number)
                found += [] if held is None else [replace(begun, point=held)]
    return found


def _for_every_law(fit: JointFit, begun: Callable[[int], list[JointFit]]) -> list[JointFit]:
    """What is `begun` for the number of each of its laws, descended; none once time is up."""
    order = min(fit.noise_order, 1)
    found: list[JointFit] = []
    for number in laws_of(fit):
        if not time_is_up():
            found += raced([one.descended_under(order, FIRST_STEPS) for one in begun(number)])
    return found


def _over_the_motion(fit: JointFit, number: int, known: Sequence[JointFit]) -> list[JointFit]:
    """Without the law of effect `number`, G descended, with those of other labels that promise most over the
    motion that it looked at, of no strength yet."""
    label = fit.values.effects[number].form.label
    rest = fit.without(label).descended()
    same = [
        one for one in known if one.labels == rest.labels and one.response.weights is fit.response.weights
    ]
    rest = highest([rest, *same])
    motion, noises = replace(Motion.of(fit, number), fit=rest), noise_screens(rest)
    weights = rest.response.weights
    slopes = [rest.response.along(rest.values, i).slope for i in range(len(rest.response.records))]
    if weights is not None:
        slopes = [slope / weight for slope, weight in zip(slopes, weights, strict=True)]
    promising: list[tuple[float, Effect]] = []
    for form in (f for f in EXCHANGED if f.label not in (label, *rest.labels)):
        laws = motion.laws(form)
        columns = [
            port_columns(rest.values, torques) * slope
            for torques, slope in zip(motion.beside(laws)[1], slopes, strict=True)
        ]
        gains = np.max([noise.gains(columns) for noise in noises], axis=0)
        best = int(np.argmax(gains))
        promising.append((float(gains[best]), laws[best]))
    chosen = sorted(promising, key=lambda one: -one[0])[:MOST_TRIED]
    return [
        rest.moved(
            rest.structure, JointValues(rest.values.cascade, (*rest.values.effects, law)), rest.point.whitener
        )
        for gain, law in chosen
        if gain > 0
    ]


def laws_of(fit: JointFit) -> list[int]:
    """Numbers of its effects that are laws of their own and not periodic in position."""
    effects = enumerate(fit.values.effects)
    return [number for number, e in effects if e.is_own_law and e.form.law not in PERIODIC]


def looks_beside_position(fit: JointFit) -> bool:
    """Whether a law of the position looks at a motion of its own: what stops an axis is where it stands."""
    laws = [e for e in fit.values.effects if e.is_own_law and e.form.base == K.BASE_POSITION]
    return any(e.looks_at_states for e in laws)


def exchanges(fit: AnyFit, number: int, forms: Sequence[Form]) -> list[AnyFit]:
    """The fit with the law of effect `number` exchanged for those of `forms` that give nearly the same
    torque, the most alike first, not descended."""
    old = _Old(Motion.of(fit, number), number)
    begun = [one for form in forms if form is not old.effect.form for one in old.exchanged_for(form)]
    begun = sorted((one for one in begun if one.alike > ALIKE), key=lambda one: -one.alike)
    return cast(list[AnyFit], [one.fit for one in begun])


def as_laws_of_the_demand(fit: AnyFit, number: int) -> list[AnyFit]:
    """The fit with the law of effect `number` exchanged for those of what the loop asks for that give nearly
    the same torque, not descended: begun where next to none of that is the command, and all are states."""
    old = _Old(Motion.of(fit, number), number)
    by_states = (BY_STATES * fit.response.scale.speed,)
    begun = [one for form in OF_DEMAND for one in old.exchanged_for(form, [by_states])]
    return cast(list[AnyFit], [one.fit for one in begun if one.alike > ALIKE])


def more_of_the_command(fit: AnyFit) -> AnyFit:
    """The last law, one of what the loop asks for, with more of the command in that and the states as they
    are in units of its size."""
    values = fit.values
    last, ports = values.effects[-1], values.effects[-1].ports
    assert ports is not None
    seen = replace(
        ports,
        signal_real=COMMAND_LET_IN * ports.signal_real,
        signal_sections=COMMAND_LET_IN * ports.signal_sections,
    )
    law = replace(last, values=COMMAND_LET_IN * last.values, ports=seen)
    return fit.moved(
        fit.structure, JointValues(values.cascade, (*values.effects[:-1], law)), fit.point.whitener
    )


@dataclass(frozen=True, eq=False)
class _Old:
    """An effect in its place of a fit, and the motion that it looked at."""

    motion: Motion
    number: int

    @property
    def effect(self) -> Effect:
        return self.motion.fit.values.effects[self.number]

    def exchanged_for(self, form: Form, starts: Sequence[Sequence[float]] = ()) -> list[_Begun]:
        """The most alike of the form's starts, or of those given; none where every one of them rests."""
        found, torque = self.motion.laws(form, starts), self.motion.torque
        torques = np.concatenate(self.motion.beside(found)[1], axis=1)
        products, powers = torques @ torque, np.sum(torques**2, axis=1)
        alike = np.abs(products) / np.sqrt(np.maximum(powers, 1e-300) * float(torque @ torque))
        best = int(np.argmax(np.where(np.isfinite(alike), alike, 0.0)))
        if not powers[best] > 0:
            return []
        return [_Begun(float(alike[best]), self._with(found[best], float(products[best] / powers[best])))]

    def _with(self, law: Effect, strength: float) -> JointFit:
        """The fit with `law` in the old one's place, of this strength through the old one's port."""
        entered, looking = self.effect.ports, law.ports
        assert entered is not None and looking is not None
        ports = replace(
            looking,
            real=strength * entered.real,
            sections=strength * entered.sections,
            direct=entered.direct * np.array([strength, 1.0]),
        )
        fit = self.motion.fit
        effects = list(fit.values.effects)
        effects[self.number] = replace(law, ports=ports)
        return fit.moved(fit.structure, JointValues(fit.values.cascade, tuple(effects)), fit.point.whitener)
