"""The search for structure and effects together: grow, prune, advance the delay, verify."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bayes_hw.crew import each
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import JointFit, highest, raced
from bayes_hw.gap.joint.fit.structure_moves import SLACK_NATS, delayed, pruned
from bayes_hw.gap.joint.residuals.readings import Readings, read_again, weighted
from bayes_hw.gap.joint.residuals.remainder import Remainder, leaves_a_cause, remainder_of
from bayes_hw.gap.joint.residuals.tone import Tone
from bayes_hw.gap.joint.search.beginning import CONTEST_SHARE, FOLLOWED_SHARE, Beginning, one_more
from bayes_hw.gap.joint.search.fallen_limits import FallenLimits, fallen_limits
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.grown_anew import with_leading_grown_anew
from bayes_hw.gap.joint.search.hidden_zone import LEFT_OUT, clear_of_zone
from bayes_hw.gap.joint.search.judged import judged
from bayes_hw.gap.joint.search.known_input import KnownInput
from bayes_hw.gap.joint.search.observer import follows_a_cycle, observed, unobserved
from bayes_hw.gap.joint.search.period_anew import with_period_anew
from bayes_hw.gap.joint.search.rival_paths import (
    MOST_STEPS,
    as_seen,
    begun_anew,
    described,
    each_alone,
    with_exchanged_laws,
    with_labels_exchanged,
    with_those_followed,
    with_what_it_asks,
)
from bayes_hw.gap.joint.search.structural import STRUCTURAL_NATS, finer, structural, within_sample
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS, asked_of
from bayes_hw.phrases import log_evidence
from bayes_hw.record import Record
from bayes_hw.time_budget import at_most, seconds_left, time_is_up

MOST_CONTENDERS = 3
"""Labels that are given the ports, forms and poles they ask for."""

HALFWAY = 0.5
"""Share of what verification asks of a label that it must gain at first where others stand."""

MOST_EFFECTS = 3
SEARCHED = 0.6
"""Of the time left, that looking further may take: the rest is for verification."""


@dataclass(frozen=True, eq=False)
class JointAnswer:
    """What the search found: `fit` with its effects, `base` the best without any, the verified nats of every
    label, the best score over the base's that every label reached alone (those that were followed to the end
    in place of the answer, there: `ends` has their fits), faults of the readings, and what is left; of an
    answer of several labels `stand_ins`, by how many nats it leads with another label in the place of one.
    `known` says of every known input what was found; those accepted are part of `base`. `tone` is a motion of
    one frequency in time that was taken out of the records of both; with limits that have `fallen` in every
    record `fit` is to the commands that were left. Fits are to samples that are `clear_of_zone` where a slow
    error asks for that. A search that was `cut_short` had no time left to grow G, to look further, or to
    begin again clear of the dead zone."""

    fit: JointFit
    base: JointFit
    nats: Mapping[str, float]
    rivals: Mapping[str, float]
    readings: Readings
    remainder: Remainder
    known: tuple[KnownInput, ...] = ()
    tone: Tone | None = None
    fallen: FallenLimits | None = None
    ends: Mapping[str, JointFit] = field(default_factory=dict)
    clear_of_zone: bool = False
    cut_short: bool = False
    stand_ins: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def followed(self) -> tuple[str, ...]:
        """Labels that were followed to the end."""
        return tuple(self.ends)

    @property
    def bare(self) -> JointFit:
        """The best cascade without effects and without known inputs."""
        return next((one.without for one in self.known if one.without is not None), self.base)

    @cached_property
    def follows_no_better(self) -> bool:
        """Whether the explanation, simulated without the corrections that it was fitted with, is further from
        the records than the model without it, and so a cycle after the last correction."""
        if self.fit.observer is None or unobserved(self.fit)[0].point.rms < self.base.point.rms:
            return False
        return not follows_a_cycle(self.fit)


def search(records: Sequence[Record], say: Callable[[str], None] | None = None) -> JointAnswer:
    """Grow, prune, verify; `say` is told of every step. Where noise of a cause is found, or colour that is
    not of a law's own motion, all begins again on the samples that lie clear of the dead zone, if there is as
    much time for that as it took before; at once where the beginning says so."""
    told, at_first = say or silent, seconds_left()
    beginning = Beginning.of(records, told)
    if beginning.clear_of_zone:
        return replace(_searched(beginning, records, told), clear_of_zone=True)
    best = highest([beginning.base, *beginning.trials])
    clear = clear_of_zone(best, records) if beginning.is_of_slow_noise else None
    if clear is None:
        found = _searched(beginning, records, told)
        laws = any(effect.ports is not None for effect in found.fit.response.template)
        unnamed = not laws and leaves_a_cause(found.fit)
        if found.fit.response.cause is None and not unnamed:
            return found
        clear = clear_of_zone(found.fit, records)
        if clear is None:
            return found
        if seconds_left() < 0.5 * at_first:
            return replace(found, cut_short=True)
    told(LEFT_OUT)
    return replace(_searched(Beginning.of(clear, told), records, told), clear_of_zone=True)


def _searched(begun: Beginning, whole: Sequence[Record], told: Callable[[str], None]) -> JointAnswer:
    """`search` of records, which are `whole` but for samples that are left out."""
    base, readings, trials, tone = begun.base, begun.readings, begun.trials, begun.tone
    if line := begun.leading_tone:
        found = _beside_tone(line, base, highest([base, *trials]), readings, whole, told)
    else:
        found = _explained(base, trials, readings, whole, told)
        if tone is not None and tone.without.score > max(base.score, found.fit.score) + VERIFIED_NATS:
            found = _beside_tone(tone, base, found.fit, readings, whole, told)
        elif found.base.response.weights is base.response.weights:
            found = _beside_fallen_limits(found, told)
    return replace(found, known=begun.known, cut_short=found.cut_short or begun.unfinished)


def _beside_tone(
    tone: Tone,
    base: JointFit,
    instead: JointFit,
    readings: Readings,
    whole: Sequence[Record],
    told: Callable[[str], None],
) -> JointAnswer:
    """What is found once a tone is taken out of the records, which is worth what it leads over the best
    explanation that stands `instead` of it."""
    told(f"a line at {tone.frequency_hz:.3g} Hz: {log_evidence(tone.without.score - base.score)}")
    found = _explained(tone.without, one_more(tone.without), readings, whole, told)
    nats = {**found.nats, OTHER: found.fit.score - max(base.score, instead.score)}
    return replace(found, nats=nats, tone=tone)


def _beside_fallen_limits(found: JointAnswer, told: Callable[[str], None]) -> JointAnswer:
    """What was found held against limits that fall at an instant of every record: the likelier of the two is
    the answer, the other one stays beside it where it was near."""
    gained = found.fit.score - found.base.score
    asked = max(VERIFIED_NATS, FOLLOWED_SHARE * gained)
    fallen = fallen_limits(found.base, asked)
    if fallen is None or fallen.nats < asked:
        return found
    told(f"limits that fall to {fallen.left:.3g} of theirs: {log_evidence(fallen.nats)}")
    present = found.rivals.get(OTHER, -np.inf) if OTHER in found.ends else -np.inf
    if fallen.nats < max(present, 0.0):
        return found
    rivals, ends = {**found.rivals, OTHER: fallen.nats}, {**found.ends, OTHER: fallen.without}
    if fallen.nats < gained:
        return replace(found, rivals=rivals, ends=ends)
    left, nats = remainder_of(fallen.without), {OTHER: fallen.nats}
    return replace(
        found, fit=fallen.without, nats=nats, rivals=rivals, ends=ends, remainder=left, fallen=fallen
    )


def _explained(
    base: JointFit,
    trials: Sequence[JointFit],
    readings: Readings,
    whole: Sequence[Record],
    told: Callable[[str], None],
) -> JointAnswer:
    """Effects found over a cascade without any, of which `trials` are the best single ones, pruned and
    verified; a label that begins nearly as well as the best one is followed to its end as well: which of them
    is better may show only there."""
    begun = FollowedPath(base, base, readings)
    contenders, alone = _contenders(begun, trials, told)
    rivals = {label: one.score - base.score for label, one in alone.items()}
    for path in contenders:
        told(f"{log_evidence(path.fit.score - base.score)}: {described(path.fit)}")
    with at_most(SEARCHED * seconds_left()):
        ended = each(lambda path: _followed(path, told), contenders)
        ended = with_leading_grown_anew(ended, lambda path: _followed(path, told))
        cut_short = time_is_up()
    if any(path.fit.observer is not None for path in ended):
        # What one gains by its readings the others may gain as well, also where their noise asks for nothing.
        ended = each(lambda path: replace(path, fit=in_observer_form(path.fit)), ended)
    ended = [replace(path, fit=as_seen(path.fit)) for path in ended]
    if len(ended) > 1:
        ended = begun_anew(ended, told)
    ended = with_exchanged_laws(ended, list(alone.values()), told)
    ended = each(lambda path: replace(path, fit=with_period_anew(path.fit)), ended)
    leading = max(ended, key=lambda path: path.gained, default=begun)
    led, stand_ins = with_labels_exchanged(leading, told)
    others = [*alone.values(), *each_alone(led, told)]
    ended = [led if path is leading else path for path in ended] or [begun]
    stand_ins = with_those_followed(led, ended, stand_ins)
    ones = judged(ended, others, whole, told)
    origin = max(ones, key=lambda path: ones[path].path.gained)
    found = ones[origin]
    best = found.path
    instead = [p for p in ended if p is origin or p.is_without(origin)]
    as_judged = [ones[path].path if path in ones else path for path in instead]
    ends = {p.begun_with: p for p in sorted(as_judged, key=lambda p: p.gained) if p.fit.labels}
    for one in found.caused:
        label = one.fit.added[-1]
        ends[label] = one if one is best else max(one, ends.get(label, one), key=lambda p: p.gained)
    rivals |= {label: end.gained for label, end in ends.items()} | dict(found.less_likely)
    last = {label: end.fit for label, end in ends.items()}
    left = remainder_of(best.fit)
    cut_short = cut_short or time_is_up()
    return JointAnswer(
        best.fit, best.base, found.nats, rivals, best.readings, left, ends=last, cut_short=cut_short,
        stand_ins=stand_ins if origin is led and set(best.fit.labels) >= set(stand_ins) else {},
    )  # fmt: skip


def silent(message: str) -> None:
    del message


def corrected(fit: JointFit, without: JointFit) -> JointFit:
    """Where neither a port, form, pole nor further label helped a fit `without` them, and its noise is of
    high order, its motion may be one that no simulation follows: corrected by the readings, if that is
    better."""
    if fit.noise_order <= 1 or fit.score >= without.score + STRUCTURAL_NATS:
        return fit
    return in_observer_form(fit)


def in_observer_form(fit: JointFit) -> JointFit:
    """Corrected by the readings, if that is better and no cause explains the noise."""
    if fit.response.cause is not None:
        return fit
    best = highest([fit, *raced(observed(fit), fit.score)])
    return best if best.score > fit.score + STRUCTURAL_NATS else fit


def seen_through(fit: JointFit, without: JointFit) -> JointFit:
    """As a simulation again where labels that a fit `without` them lacked explain what was followed."""
    if fit.observer is None or fit.labels == without.labels:
        return fit
    return highest([fit, *raced([fit.without_observer()], fit.score)])


def _settled(fit: JointFit, trials: Sequence[JointFit], say: Callable[[str], None]) -> list[JointFit]:
    """The best explanation with one more label; and where another label's is nearly as good, both with the
    ports, forms and poles that they ask for: which of them is better shows only then."""
    ranked = sorted(trials, key=lambda t: -t.score)[:MOST_CONTENDERS]
    if not ranked:
        return []
    gained = ranked[0].score - fit.score
    near = [t for t in ranked if t.score - fit.score >= CONTEST_SHARE * gained]
    if len(near) < 2 or gained <= 0:
        return ranked[:1]

    return each(lambda contender: with_what_it_asks(contender, fit, say), near)


def _contenders(
    begun: FollowedPath, trials: Sequence[JointFit], say: Callable[[str], None]
) -> tuple[list[FollowedPath], dict[str, JointFit]]:
    """The best explanations by one label, best first, and every label's; simulations are held against
    simulations, as an observer hides what a further label would explain. After them those with an effect more
    that one hides: what is a cause of the noise it replaces."""
    fit = begun.fit
    settled = [as_seen(one) for one in _settled(fit, trials, say)]
    pairs = []
    for one in settled:
        simulation = replace(begun, fit=finer(one)).reread()
        seen = corrected(simulation.fit, simulation.fit) if len(settled) > 1 else simulation.fit
        known = len(settled) > 1 and simulation.fit is one and seen is one
        pairs.append((simulation, replace(simulation, fit=seen, settled=known)))
    # Laws that were exchanged on the way may have become one.
    gaining = sorted((pair for pair in pairs if pair[1].gained > 0), key=lambda pair: pair[1].gained)
    best = {path.begun_with: (simulation, path) for simulation, path in gaining}
    pairs = sorted(best.values(), key=lambda pair: -pair[1].gained)
    most = FOLLOWED_SHARE * max((path.gained for _, path in pairs), default=0.0)
    simulated = FOLLOWED_SHARE * max((simulation.gained for simulation, _ in pairs), default=0.0)
    near = [pair for pair in pairs if pair[0].gained >= simulated or pair[1].gained >= most]
    if near and not near[0][1].fit.effect_labels:
        # Noise takes up all that is left, an effect its own part: one of two leads by as much as both.
        near += [pair for pair in pairs if pair[1].fit.effect_labels and pair not in near][:1]
    hidden = [
        replace(simulation, fit=one)
        for simulation, path in near
        if path.fit is not simulation.fit
        for one in _with_one_more(simulation, say)
        if not one.added
    ]
    same = [path.fit for _, path in pairs if path.readings is begun.readings]
    every = (*trials, *settled, *same)
    finite = [t for t in every if np.isfinite(t.score)]
    contenders = [*(path for _, path in near), *hidden]
    return contenders, {t.labels[-1]: t for t in sorted(finite, key=lambda t: t.score)}


def _with_one_more(path: FollowedPath, say: Callable[[str], None]) -> list[JointFit]:
    """The best explanations with one label more than the path has, where it is worth enough."""
    fit = path.fit
    further = [
        t for t in one_more(fit) if t.score >= fit.score + HALFWAY * asked_of(t, path.base, path.readings)
    ]
    return _settled(fit, further, say)


def _followed(path: FollowedPath, say: Callable[[str], None]) -> FollowedPath:
    """More effects, ports and poles as long as they pay; then what does not is taken out. At the end laws may
    act within the sample even where the noise is white: a rival whose noise was not may have done so."""
    for _ in range(1, MOST_STEPS):
        if time_is_up():
            break
        fit = path.fit
        best = fit if path.settled else structural(fit)
        if best.score < fit.score + STRUCTURAL_NATS and len(fit.labels) < MOST_EFFECTS:
            best = seen_through(highest([best, *_with_one_more(path, say)]), fit)
        best = finer(best if path.settled else corrected(best, fit))
        if best.score < fit.score + SLACK_NATS:
            break
        say(f"{log_evidence(best.score - fit.score)}: {described(best)}")
        path = replace(path, fit=best, settled=False).reread()
    first = pruned(path.fit)
    later = delayed(first)
    fit = within_sample(later if later is first else pruned(later))
    say(f"pruned: {described(fit)}")
    base, fit, readings = read_again(
        path.base, fit, path.readings, lambda f, again: weighted(f, again.weights)
    )
    return FollowedPath(fit, base, readings)
