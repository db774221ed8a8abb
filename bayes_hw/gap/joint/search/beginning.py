"""Where the joint search begins: the best cascade without effects, and the best by one label each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.gap.joint.fit.base_cascade import grown_base
from bayes_hw.gap.joint.fit.joint_fit import JointFit, highest
from bayes_hw.gap.joint.fit.other_cascades import with_pole
from bayes_hw.gap.joint.fit.structure_moves import regrown
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.residuals.heavy_tails import with_heavy_tails
from bayes_hw.gap.joint.residuals.jumps import jumps
from bayes_hw.gap.joint.residuals.readings import Readings, glitches_read_again, read_faults, weighted
from bayes_hw.gap.joint.residuals.remainder import coloured_nats, leaves_a_cause
from bayes_hw.gap.joint.residuals.rounded_readings import without_rounding
from bayes_hw.gap.joint.residuals.tone import Tone, tone_in
from bayes_hw.gap.joint.search.effect_moves import effect_candidates, slow_causes
from bayes_hw.gap.joint.search.hidden_zone import LEFT_OUT, where_it_shows
from bayes_hw.gap.joint.search.known_input import KnownInput, with_known_inputs
from bayes_hw.gap.joint.search.laws_of_states import every_law
from bayes_hw.gap.joint.search.rival_paths import described
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS, asked_of
from bayes_hw.identify.cascade_roots import poles_of
from bayes_hw.identify.experiment import white_noise_level
from bayes_hw.phrases import log_evidence
from bayes_hw.record import Record
from bayes_hw.time_budget import at_most, seconds_left, time_is_up

CONTEST_SHARE = 0.3
"""Of the best label's nats, from which another is given the ports, forms and poles it asks for as well."""

FOLLOWED_SHARE = 0.7
"""Of the best label's nats, from which another is followed to the end beside it."""

TRACE = 0.1
"""Of the nats that noise of high order holds: a label that explains less is not what made it."""

SHOWN = 0.2
"""Of those nats, from which the best label shows what it is by itself."""

LASTING = 0.2
"""Share of the longest record that a pole remembers which lasts."""

GROWN = 0.5
"""Of the time left, that the cascade without effects may take."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """The best cascade without effects, known inputs in it, faults of the readings, the best explanations by
    one label each, and a motion of one frequency in time; `unfinished` where growing had no time left, all
    of samples `clear_of_zone` where what is left of the others comes and goes with the dead zone."""

    base: JointFit
    readings: Readings
    known: tuple[KnownInput, ...]
    trials: tuple[JointFit, ...]
    tone: Tone | None
    unfinished: bool
    clear_of_zone: bool = False

    @classmethod
    def of(cls, records: Sequence[Record], told: Callable[[str], None]) -> Beginning:
        """Grown on records at one rate; `told` is told of every step."""
        with at_most(GROWN * seconds_left()):
            base, readings = _begun(records, told)
            clear = where_it_shows(base, records)
            if clear is None:
                base = with_heavy_tails(base, VERIFIED_NATS, readings.step)
            unfinished = time_is_up()
        if clear is not None:
            told(LEFT_OUT)
            return replace(cls.of(clear, told), clear_of_zone=True)
        base, known = with_known_inputs(base)
        for one in known:
            told(f"known input {one.column} as a {one.way}: {log_evidence(one.nats)}")
        if any(one.accepted for one in known) and not readings.nats:
            readings = read_faults(base)
            if readings.nats:
                base = weighted(base, readings.weights)
        return cls(base, readings, known, tuple(_first_labels(base, readings)), tone_in(base), unfinished)

    @property
    def leading_tone(self) -> Tone | None:
        """The motion of one frequency where it explains more than any label."""
        return self.tone if self.tone and leads(self.tone, self.base, self.trials) else None

    @property
    def is_of_slow_noise(self) -> bool:
        """Whether a cause of the noise leads every label by far, or no label explains more than a trace of
        what noise of high order holds."""
        ranked = sorted(self.trials, key=lambda t: -t.score)
        if not ranked or self.leading_tone:
            return False
        gains = [trial.score - self.base.score for trial in ranked[:2]]
        caused = bool(ranked[0].added) and gains[-1] < FOLLOWED_SHARE * gains[0] and gains[0] > 0
        return caused or (leaves_a_cause(self.base) and gains[0] < TRACE * coloured_nats(self.base))


def leads(tone: Tone, base: JointFit, trials: Sequence[JointFit]) -> bool:
    """Whether a motion of one frequency in time explains so much of a base's residual that no label alone is
    a contender, as of labels among each other."""
    gained = tone.without.score - base.score
    most = max((trial.score - base.score for trial in trials), default=0.0)
    return gained > VERIFIED_NATS and most < CONTEST_SHARE * gained


def _begun(records: Sequence[Record], say: Callable[[str], None]) -> tuple[JointFit, Readings]:
    """The best cascade without effects under the weights that the readings' faults ask for."""
    base = grown_base(records, white_noise_level([record.y_or_nan for record in records]))
    readings = read_faults(base)
    scale = readings.seen_in(base.response.scale)
    base = replace(base, response=replace(base.response, scale=scale))
    if readings.rounded_first:
        base, readings = without_rounding(base, readings)
        base = regrown(base) if readings.taken_off else base
    if any(np.any(w != 1) for w in readings.weights):
        base = weighted(base, readings.weights)
        again = glitches_read_again(base, readings)
        if again is not readings:
            base, readings = weighted(base, again.weights), again
    say(f"without effects: {described(base)}")
    return base, readings


def _first_labels(base: JointFit, readings: Readings) -> list[JointFit]:
    """The best explanations by one label. Where noise of high order is left, also over G with a pole that
    lasts, if it has none: torques may move the axis for good where commands do not. Where they leave most of
    what such noise holds, or none could be verified, also by laws that look at the states of G from the first
    step on: what such a law does shows to no step that begins without them if G stands in for much of it, and
    leaves noise that is nearly white."""
    found = one_more(base)
    over = base
    for lasting in with_lasting_pole(base) if leaves_a_cause(base) else []:
        further = one_more(lasting)
        found += further
        over = lasting if found and highest(found) in further else base
    asked = SHOWN * coloured_nats(base)
    if all(trial.score - base.score <= max(asked, asked_of(trial, base, readings)) for trial in found):
        found += every_law(over)
    best: dict[str, JointFit] = {}
    for trial in sorted(found, key=lambda t: -t.score):
        best.setdefault(trial.labels[-1], trial)
    return list(best.values())


def with_lasting_pole(fit: JointFit) -> list[JointFit]:
    """With one more real pole, of no weight yet, that remembers as long as the records last, where G has none
    that remembers LASTING of that. An integrator is none: no torque enters it, as behind a loop with integral
    action none moves the axis for good; without such action torques do."""
    samples = fit.response.scale.samples
    radii = np.abs(poles_of(fit.values.cascade, integrator=False))
    if radii.max(initial=0.0) > np.exp(-1 / (LASTING * samples)):
        return []
    return [with_pole(fit, float(np.exp(-1 / samples)))]


def one_more(fit: JointFit) -> list[JointFit]:
    """The best explanations with one more label; of causes of the noise the likelier."""
    slow = [t for t in slow_causes(fit) if not jumps(t)]
    effects = [t for t in effect_candidates(fit, FORMS) if is_followed(t, fit)]
    return [*effects, *([highest(slow)] if slow else [])]


def is_followed(fit: JointFit, without: JointFit) -> bool:
    """Whether what is left of the records grows no larger by an effect beside noise of a cause.

    Such noise weighs the steps of the error and leaves its level to itself: an effect may make it likelier
    and the error larger, and then follows the noise.
    """
    return not without.added or fit.point.rms <= without.point.rms
