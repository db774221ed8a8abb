"""The search for structure and effects together: grow, prune, advance the delay, verify."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.base_cascade import grown_base
from bayes_hw.gap.joint.effect_form import FORMS
from bayes_hw.gap.joint.joint_fit import JointFit, highest
from bayes_hw.gap.joint.joint_moves import (
    FIRST_STEPS,
    delayed,
    effect_candidates,
    larger_cascades,
    port_candidates,
    pruned,
    regrown,
)
from bayes_hw.gap.joint.known_input import KnownInput, with_known_inputs
from bayes_hw.gap.joint.readings import Readings, read_again, read_faults, weighted
from bayes_hw.gap.joint.remainder import Remainder, remainder_of
from bayes_hw.gap.joint.tone import Tone, tone_in
from bayes_hw.identify.experiment import white_noise_level
from bayes_hw.record import Record

VERIFIED_NATS = 25.0
"""That a label must be worth when it is dropped and G grown again."""

VERIFIED_BESIDE_NATS = 80.0
"""Where readings are rounded, held or late, so that the noise is not normal."""

STRUCTURAL_NATS = 5.0
"""A port or a section that gains as much is taken before another effect is looked for."""

MOST_CONTENDERS, CONTEST_SHARE, LARGE_ORDER = 2, 0.4, 8
"""Labels that are followed further, the share of the best one's nats from which, and the order of G above
which it is pruned first."""

STEPS_OF_A_PERIOD = 3.0
"""Of rounding: a shorter period in position is that of the rounding itself."""

UNNAMED_NATS, UNNAMED_SHARE = 20.0, 0.1
"""What a law without a name must be better by than one that has one: in nats, and as a share of what it
gains, since laws within G's ports are approximate."""

MOST_EFFECTS, MOST_STEPS = 3, 10


@dataclass(frozen=True, eq=False)
class JointAnswer:
    """What the search found: `fit` with its effects, `base` the best without any, the verified nats of every
    label, the best score over the base's that every label reached alone, faults of the readings, and what is
    left. `known` says of every known input what was found; those accepted are part of `base`. `tone` is a
    motion of one frequency in time that was taken out of the records of both."""

    fit: JointFit
    base: JointFit
    nats: Mapping[str, float]
    rivals: Mapping[str, float]
    readings: Readings
    remainder: Remainder
    known: tuple[KnownInput, ...] = ()
    tone: Tone | None = None

    @property
    def bare(self) -> JointFit:
        """The best cascade without effects and without known inputs."""
        return next((one.without for one in self.known if one.without is not None), self.base)


def search(records: Sequence[Record], say: Callable[[str], None] | None = None) -> JointAnswer:
    """Grow, prune, verify; `say` is told of every step."""
    told = say or silent
    base, readings = _begun(records, told)
    base, known = with_known_inputs(base)
    for one in known:
        told(f"known input {one.column} as a {one.way}: {one.nats:.0f} nats")
    if any(one.accepted for one in known) and not readings.nats:
        readings = read_faults(base)
        if readings.nats:
            base = weighted(base, readings.weights)
    found = _explained(base, readings, told)
    tone = tone_in(base)
    if tone is not None and tone.without.score > max(base.score, found.fit.score) + VERIFIED_NATS:
        told(f"a line at {tone.frequency_hz:.3g} Hz: {tone.without.score - base.score:.0f} nats")
        without, found = found, _explained(tone.without, readings, told)
        nats = {**found.nats, OTHER: found.fit.score - max(base.score, without.fit.score)}
        found = replace(found, nats=nats, tone=tone)
    return replace(found, known=known)


def _explained(base: JointFit, readings: Readings, told: Callable[[str], None]) -> JointAnswer:
    """Effects found over a cascade without any, pruned and verified."""
    begun = base.score
    fit, base, readings, alone = _grown(base, readings, told)
    if fit.labels:
        fit = pruned(delayed(pruned(fit)))
        told(f"pruned: {described(fit)}")
        base, fit, readings = read_again(base, fit, readings, lambda f, again: weighted(f, again.weights))
    asked = VERIFIED_BESIDE_NATS if readings.nats else VERIFIED_NATS
    fit, nats = verified(fit, [base, *alone.values()], asked, told)
    rivals = {label: one.score - begun for label, one in alone.items()}
    return JointAnswer(fit, base, nats, rivals, readings, remainder_of(fit))


def described(fit: JointFit) -> str:
    """One line on a fit."""
    names = " + ".join(fit.names) or "no effect"
    if fit.response.steps > 1:
        names += f" in {fit.response.steps} steps a sample"
    order, noise = fit.structure.order, fit.point.whitener.order
    return f"{names}; G of order {order}, delay {fit.structure.delay_samples}, noise of order {noise}"


def silent(message: str) -> None:
    del message


def _begun(records: Sequence[Record], say: Callable[[str], None]) -> tuple[JointFit, Readings]:
    """The best cascade without effects under the weights that the readings' faults ask for."""
    base = grown_base(records, white_noise_level([record.y_or_nan for record in records]))
    readings = read_faults(base)
    if "encoder_quantization" in readings.nats and readings.step is not None:
        scale = replace(base.response.scale, shortest=STEPS_OF_A_PERIOD * readings.step)
        base = replace(base, response=replace(base.response, scale=scale))
    if any(np.any(w != 1) for w in readings.weights):
        base = weighted(base, readings.weights)
        again = read_faults(replace(base, response=replace(base.response, weights=None)))
        if "outliers" in readings.nats and again.nats.get("outliers", 0) > 0:
            readings = again
            base = weighted(base, readings.weights)
    say(f"without effects: {described(base)}")
    return base, readings


def _structural(fit: JointFit) -> JointFit:
    """The best of the present effects with other ports, another form of their law, or a larger G."""
    trials = port_candidates(fit) + larger_cascades(fit)
    trials = sorted((t.descended(FIRST_STEPS) for t in trials), key=lambda t: -t.score)[:3]
    return highest([fit, *(t.descended() for t in trials)])


def finer(fit: JointFit) -> JointFit:
    """With laws that act several times a sample, where that is better."""
    laws = any(e.ports is not None and not e.form.column for e in fit.response.template)
    if not laws or fit.response.steps > 1 or fit.point.whitener.order == 0:
        return fit
    trial = fit.finer().descended()
    return trial if trial.score > fit.score + STRUCTURAL_NATS else fit


def _settled(fit: JointFit, trials: Sequence[JointFit]) -> list[JointFit]:
    """The best explanation with one more label; and where another label's is nearly as good, both with the
    ports, forms and poles that they ask for: which of them is better shows only then."""
    ranked = sorted(trials, key=lambda t: -t.score)[:MOST_CONTENDERS]
    if not ranked:
        return []
    gained = ranked[0].score - fit.score
    near = [t for t in ranked if t.score - fit.score >= CONTEST_SHARE * gained]
    if len(near) < 2 or gained <= 0:
        return ranked[:1]
    found = []
    for contender in near:
        if contender.structure.order > LARGE_ORDER:
            # A G that grew to stand in for the effect is in its way.
            contender = pruned(contender)
        for _ in range(MOST_STEPS):
            larger = _structural(contender)
            if larger.score < contender.score + STRUCTURAL_NATS:
                break
            contender = larger
        found.append(contender)
    return found


def _with_handicap(fit: JointFit, begun: float) -> float:
    """Score, less what a law without a name must be better by than one that has one."""
    gained = max(fit.score - begun, 0.0)
    return fit.score - max(UNNAMED_NATS, UNNAMED_SHARE * gained) * (OTHER in fit.labels)


def _grown(
    base: JointFit, readings: Readings, say: Callable[[str], None]
) -> tuple[JointFit, JointFit, Readings, dict[str, JointFit]]:
    """The fit with effects, the base and the readings under the last weights, and the best explanation by
    every label alone."""
    fit, alone = base, dict[str, JointFit]()
    for step in range(MOST_STEPS):
        best = _structural(fit) if step else fit
        if best.score < fit.score + STRUCTURAL_NATS and len(fit.labels) < MOST_EFFECTS:
            trials = effect_candidates(fit, FORMS)
            settled = _settled(fit, trials)
            if step == 0:
                alone = {t.labels[-1]: t for t in (*trials, *settled)}
            best = max([best, *settled], key=lambda t: _with_handicap(t, base.score))
        best = finer(best)
        if best.score <= fit.score:
            break
        say(f"{best.score - fit.score:.0f} nats: {described(best)}")
        fit = best
        if fit.labels and not readings.nats:
            later = read_faults(fit)
            if later.nats:
                readings = later
                base, fit = weighted(base, later.weights), weighted(fit, later.weights)
    return fit, base, readings, alone


def verified(
    fit: JointFit, others: Sequence[JointFit], asked: float, say: Callable[[str], None]
) -> tuple[JointFit, dict[str, float]]:
    """Labels that are still worth `asked` nats when each is dropped and G grown again, with those nats.

    Any of the `others`, of the labels that are left and under the same weights, may do better than that.
    """
    while fit.labels:
        nats: dict[str, float] = {}
        alternatives = []
        for i, label in zip(fit.numbers, fit.labels, strict=True):
            without = regrown(fit.without_effect(i))
            weights = fit.response.weights
            same = [o for o in others if o.labels == without.labels and o.response.weights is weights]
            without = highest([without, *same])
            nats[label] = fit.score - without.score
            alternatives.append(without)
        say("verified: " + ", ".join(f"{label} {value:.0f} nats" for label, value in nats.items()))
        weakest = int(np.argmin([nats[label] for label in fit.labels]))
        if nats[fit.labels[weakest]] >= asked:
            return fit, nats
        fit = alternatives[weakest]
    return fit, {}
