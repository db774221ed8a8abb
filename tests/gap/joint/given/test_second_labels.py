"""A second label is sought beside those that another outdoes alone."""

from __future__ import annotations

from dataclasses import replace

from joint_axis import measured, model

from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.given_search import best_base
from bayes_hw.gap.joint.given.second_labels import SECONDS, second_to


def test_a_second_label_is_sought_beside_the_best_of_all_others() -> None:
    """Of what labels alone reached under the same samples; slow noise, the fit's own label and what earns
    little beside the fit left out."""
    base = best_base(measured((), 400, (1,)), model())
    other = best_base(measured((), 400, (2,)), model())
    sizes = {"command_bias": 0.5, "gain_asymmetry": 0.6, "rate_limit": 0.4, "cubic_stiffness": 0.02}

    def reaching(label: str, share: float) -> GivenFit:
        law = next(f for f in FORMS if f.label == label)
        fit = base.with_effect(law, law.starts(base.response.scale)[0])
        likelihood = fit.point.log_likelihood + base.score - fit.score + 100 * share
        return replace(fit, point=replace(fit.point, log_likelihood=likelihood))

    best = reaching("friction", 1.0)
    alone = {label: reaching(label, share) for label, share in sizes.items()} | {"friction": best}
    alone |= {"wind": best, "gain_drift": other}
    found = second_to(best, base, alone)
    scores = [one.score for one in found]
    assert scores == sorted(scores, reverse=True)
    assert {one.labels for one in found} == {(label,) for label, share in sizes.items() if share > 0.1}
    more = alone | {label: reaching(label, 0.9) for label in ("backlash", "torque_ripple")}
    fewer = second_to(best, base, more)
    assert len(fewer) == SECONDS
    assert {one.labels for one in fewer} > {("backlash",), ("torque_ripple",)}
