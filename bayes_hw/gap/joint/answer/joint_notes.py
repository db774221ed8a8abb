"""What a reader should know beside the answer of the joint search."""

from __future__ import annotations

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.notes import CUT_SHORT
from bayes_hw.gap.joint.decision.joint_decision import JointDecision
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.joint_forms import AS_SHAPE, TURNS_SEEN
from bayes_hw.gap.joint.posterior.joint_closure import spread
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.gap.joint.search.observer import unobserved
from bayes_hw.phrases import log_evidence

SHAPES = ("reading over position", "torque over position", *(form.name for form in AS_SHAPE.values()))
"""Forms without a name that are too wide to be told as a period."""


def notes_on_search(found: JointAnswer, decision: JointDecision) -> list[str]:
    """How torques enter, what every label is worth, what has no name, which rivals are as good."""
    fit = found.fit
    said = fit.said_of_g()
    if found.cut_short:
        said.append(CUT_SHORT)
    if found.tone is not None:
        said.append(
            f"a motion of {found.tone.frequency_hz:.4g} Hz in time, of amplitude {found.tone.amplitude:.2g} "
            f"{fit.response.records[0].units.output}, whatever was commanded: no entry explains it, a "
            "machine nearby may"
        )
    said += of_followed(fit)
    if found.clear_of_zone:
        said.append(
            "what a slow error of the axis may shift into the dead zone, where it does not show, was left "
            "out of the fit"
        )
    said += [
        f"without {label}: {log_evidence(-found.nats[label])}, {fit.dropped_then}"
        for label in fit.labels
        if label in found.nats and label in decision.answer
    ]
    if OTHER in decision.answer:
        said += of_unnamed(fit)
        if fit.response.cause is not None and fit.added[-1] not in decision.answer:
            said.append(
                f"what is slow in the error is no {fit.added[-1]}: it comes in pulses, or knows how the axis "
                "is used"
            )
        if found.fallen is not None:
            said.append(
                "what has no name is most like limits that fall at an instant of every record and stay at "
                f"{found.fallen.left:.3g} of theirs, as those of a drive that got hot; nobody knows when "
                "they fall next, so that this is no part of the prediction"
            )
        if fit.without_name is not None:
            said.append(
                f"what has no name is most like {fit.without_name}; its size is that of what is left, and "
                "no part of the prediction"
            )
    return said + [
        f"{rival} explains these records about as well as {named}" for named, rival in decision.confusable
    ]


def of_followed(fit: JointFit) -> list[str]:
    """That the readings corrected the motion as it was fitted, and how far a simulation of it is off."""
    if fit.observer is None:
        return []
    off, left, unit = spread(unobserved(fit)[0]), spread(fit), fit.response.records[0].units.output
    return [
        "small differences grow in the motion of this explanation: it was fitted with its states corrected "
        "at every sample by what the encoder shows; a simulation, which nothing corrects, is off by "
        f"{off:.2g} {unit} (root mean square) where the corrected motion leaves {left:.2g}"
    ]


def of_unnamed(fit: JointFit) -> list[str]:
    """What the effects without a name are like; one over position may be no period."""
    found = []
    for effect in fit.values.effects:
        if effect.form.label != OTHER:
            continue
        note = f"what has no name is most like this: {effect.form.name}"
        if effect.form.name in SHAPES:
            note += (
                f", a shape that repeats fewer than {TURNS_SEEN:g} times within the travel, so that nothing "
                "tells whether it is periodic; a longer travel would"
            )
        found.append(note)
    return found
