"""How far the missing effect had pushed the parameters of the base model."""

from __future__ import annotations

from dataclasses import dataclass

from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate
from bayes_hw.gap.diagnosis import Diagnosis


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


def base_shifts(diagnosis: Diagnosis) -> list[BaseShift]:
    """Every base parameter of the verdict."""
    base = diagnosis.attribution.base
    hypothesis = base.fit.hypothesis
    nominal = {p.name: p.nominal for p in hypothesis.parameters}
    alone = {p.name: float(v) for p, v in zip(hypothesis.parameters, base.fit.values, strict=True)}
    nominal[NOISE_SIGMA] = diagnosis.case.model.noise_sigma
    alone[NOISE_SIGMA] = base.encoder_sigma
    return [
        BaseShift(name, nominal[name], alone[name], joint) for name, joint in diagnosis.verdict.base.items()
    ]
