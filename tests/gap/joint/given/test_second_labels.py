"""A second label is sought beside those that another outdoes alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from joint_axis import measured, model

from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.given import second_labels
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.given.second_labels import SECONDS, both_instead, second_to
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.identify.growth.levels import WHITE


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


def test_two_labels_are_sought_where_several_explain_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside those that are none of them, and taken where they are worth what two must be."""
    base = best_base(measured((), 400, (1,)), model())

    def reaching(labels: Sequence[str], nats: float) -> GivenFit:
        fit = base
        for label in labels:
            law = next(f for f in FORMS if f.label == label)
            fit = fit.with_effect(law, law.starts(base.response.scale)[0])
        likelihood = fit.point.log_likelihood + base.score - fit.score + nats
        return replace(fit, point=replace(fit.point, log_likelihood=likelihood, whitener=WHITE))

    gap, rub, bias = (
        reaching([x], n) for x, n in (("backlash", 600), ("friction", 590), ("command_bias", 300))
    )
    alone = {"backlash": gap, "friction": rub, "command_bias": bias}
    begun: list[Sequence[GivenFit]] = []

    def both(nats: float) -> Callable[[Sequence[GivenFit]], list[GivenFit]]:
        pair = reaching(["command_bias", "gain_drift"], nats)
        return lambda others: begun.append(others) or [pair]  # type: ignore[func-returns-value]

    monkeypatch.setattr(second_labels, "settled", lambda fit: fit)
    monkeypatch.setattr(second_labels, "pruned", lambda fit: fit)
    ends, readings = {"backlash": gap, "friction": rub}, read_faults(base)
    for nats, taken in ((900.0, True), (610.0, False)):
        monkeypatch.setattr(second_labels, "beside_each", both(nats))
        found = both_instead(gap, ends, base, readings, alone)
        assert (found is not None) is taken
    assert begun == [[bias], [bias]]
    apart = {"backlash": gap, "friction": reaching(["friction"], 400)}
    assert both_instead(gap, apart, base, readings, alone) is None
    assert len(begun) == 2
