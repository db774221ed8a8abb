"""How far the missing effect had pushed the parameters of the base model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate
from bayes_hw.gap.fit.explanation import Explanation


@dataclass(frozen=True)
class BaseShift:
    """A base parameter: as given, fitted without effects, and estimated jointly with the answer's effects."""

    name: str
    nominal: float
    alone: float
    joint: Estimate

    @property
    def pushed(self) -> float:
        """Fit alone less joint estimate, in standard deviations of the joint estimate."""
        return (self.alone - self.joint.mean) / self.joint.sd if self.joint.sd > 0 else float("nan")


def base_shifts(
    base: Explanation, nominal_sigma: float, estimates: Mapping[str, Estimate]
) -> list[BaseShift]:
    """Every base parameter of `estimates`, those of a verdict.

    `base` is the base model fitted alone, `nominal_sigma` the encoder's noise as given, output units.
    """
    hypothesis = base.fit.hypothesis
    nominal = {p.name: p.nominal for p in hypothesis.parameters}
    alone = {p.name: float(v) for p, v in zip(hypothesis.parameters, base.fit.values, strict=True)}
    nominal[NOISE_SIGMA] = nominal_sigma
    alone[NOISE_SIGMA] = base.encoder_sigma
    return [BaseShift(name, nominal[name], alone[name], joint) for name, joint in estimates.items()]
