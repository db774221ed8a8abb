"""A second label is sought beside those that another outdoes alone."""

from __future__ import annotations

from joint_axis import measured, model

from bayes_hw.gap.joint.forms.effect_form import FORMS
from bayes_hw.gap.joint.given.given_search import best_base
from bayes_hw.gap.joint.given.second_labels import SECONDS, second_to


def test_a_second_label_is_sought_beside_the_best_of_all_others() -> None:
    """Of what labels alone reached under the same samples, slow noise and the fit's own label left out."""
    base = best_base(measured((), 400, (1,)), model())
    other = best_base(measured((), 400, (2,)), model())
    kinds = ("command_bias", "gain_asymmetry", "rate_limit", "cubic_stiffness", "friction", "backlash")
    laws = {label: next(f for f in FORMS if f.label == label) for label in kinds}
    alone = {label: base.with_effect(law, law.starts(base.response.scale)[0]) for label, law in laws.items()}
    alone |= {"wind": base, "gain_drift": other, "saturation_drift": base}
    found = second_to(alone["friction"], alone)  # type: ignore[arg-type]
    scores = [one.score for one in found]
    assert scores == sorted(scores, reverse=True)
    assert {one.labels for one in found} == {(), *((label,) for label in kinds if label != "friction")}
    fewer = second_to(base, alone)  # type: ignore[arg-type]
    assert len(fewer) == SECONDS
    assert min(one.score for one in fewer) >= min(one.score for one in alone.values() if one.labels)
