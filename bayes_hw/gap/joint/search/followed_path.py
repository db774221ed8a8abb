"""An explanation that the joint search follows, beside the cascade without effects."""

from __future__ import annotations

from dataclasses import dataclass

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import Readings, read_faults, weighted


@dataclass(frozen=True, eq=False)
class FollowedPath:
    """An explanation on its way, and the cascade without effects under the same weights of the readings;
    where it is `settled`, no port, form, pole, finer step nor observer helps it."""

    fit: JointFit
    base: JointFit
    readings: Readings
    settled: bool = False

    @property
    def gained(self) -> float:
        """Nats over the cascade without effects."""
        return self.fit.score - self.base.score

    @property
    def begun_with(self) -> str:
        """The label that it explains first: of an effect, else the cause of the noise."""
        return (self.fit.effect_labels or self.fit.labels)[0]

    def is_without(self, best: FollowedPath) -> bool:
        """Whether it begins with another label in place of the one that `best` begins with and not beside
        it; what stands beside either may be the same."""
        return self.begun_with not in best.fit.labels and best.begun_with not in self.fit.labels

    def reread(self) -> FollowedPath:
        """With the readings' faults looked for again, if there were none."""
        if not self.fit.labels or self.readings.nats:
            return self
        later = read_faults(self.fit)
        if not later.nats:
            return self
        return FollowedPath(weighted(self.fit, later.weights), weighted(self.base, later.weights), later)
