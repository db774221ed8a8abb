"""What may be wrong with the readings, one part each: any of them beside any other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.held_angles import held_angles
from bayes_hw.gap.joint.noise.reading_faults import (
    MASK,
    REPEAT_SHARE,
    glitches,
    repeats,
    rounded_motion,
    rounding_step,
    running_median,
)
from bayes_hw.gap.joint.residuals.rhythm import rhythm
from bayes_hw.gap.joint.residuals.speed_noise import signed_speed, speed_noise
from bayes_hw.identify.growth.descent import whitened
from bayes_hw.identify.holes import without_holes
from bayes_hw.record import Record

ROUNDING, TIMING, GLITCHES = "encoder_quantization", "timing_jitter", "outliers"
EVERY = f"{OTHER}.every"
"""Samples after which a rhythm repeats, which has no label."""

ROUNDED = 1.6
"""Step over the innovations' standard deviation from which rounding is named."""

CERTAIN_NATS = 1000.0
"""Of what readings show by themselves, whatever the axis did."""

MOVING_SHARE = 0.2
"""Of a step, by which an axis moves a sample where what rounding adds scatters as it always does."""

LEAST_LEVEL = 0.05
"""Share of the innovations' variance that is left to samples at rest at least."""


@dataclass(frozen=True, eq=False)
class Fault:
    """One fault: its label, nats and parameters, and by what it divides the residuals of every record."""

    label: str
    nats: float
    parameters: Mapping[str, float]
    weights: Sequence[FloatArray] | None = None
    step: float | None = None


@dataclass(frozen=True, eq=False)
class Looked:
    """Residuals of a fit and what is known of the readings so far: the step of their lattice, the standard
    deviation of what is left, and the weights, nats and parameters of the faults found."""

    fit: JointFit
    angles: Sequence[FloatArray]
    residuals: Sequence[FloatArray]
    moves: Sequence[FloatArray]
    step: float | None
    innovation: float
    weights: tuple[FloatArray, ...]
    nats: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    rounded_first: bool = False

    @classmethod
    def at(cls, fit: JointFit) -> Looked:
        """Nothing found yet, but for how far readings scatter that are not far off."""
        records, values = fit.response.records, fit.values
        angles = [fit.response.along(values, number).y for number in range(len(records))]
        residuals = [without_holes(e) for e in fit.errors]
        step, innovation = rounding_step(records), fit.innovation_sigma
        far = glitches(residuals, 0.0 if step is None else step / np.sqrt(12))
        if far.present:
            kept = [e[~m & ~np.isnan(e)] for e, m in zip(fit.errors, far.masks, strict=True)]
            innovation = min(innovation, float(np.std(np.concatenate(kept))))
        ones = tuple(np.ones(len(record)) for record in records)
        moves = [signed_speed(angle) for angle in angles]
        return cls(fit, angles, residuals, moves, step, innovation, ones)

    @property
    def records(self) -> Sequence[Record]:
        """The records that the fit is to."""
        return self.fit.response.records

    @property
    def errors(self) -> list[FloatArray]:
        """Residuals under the weights."""
        return [e / w for e, w in zip(self.residuals, self.weights, strict=True)]

    @property
    def rounding_error(self) -> float:
        """Standard deviation that a rounding which shows leaves, zero where none does."""
        return self.step / np.sqrt(12) if self.step is not None and ROUNDING in self.nats else 0.0

    def beside(self, fault: Fault) -> Looked:
        """With one fault more; of two with one label the first gives the nats."""
        weights = self.weights
        if fault.weights is not None:
            weights = tuple(w * f for w, f in zip(weights, fault.weights, strict=True))
        return replace(
            self,
            weights=weights,
            nats={fault.label: fault.nats, **self.nats},
            parameters={**self.parameters, **fault.parameters},
            step=fault.step or self.step,
            rounded_first=self.rounded_first or fault.step is not None,
        )


def rounded(looked: Looked) -> Fault | None:
    """Readings on a lattice that is coarser than their noise."""
    step, innovation = looked.step, looked.innovation
    if step is None or step <= ROUNDED * innovation:
        return None
    share = min(step**2 / 12 / innovation**2, 1.0)
    return Fault(ROUNDING, CERTAIN_NATS * share, {f"{ROUNDING}.step": step})


def repeated(looked: Looked) -> Fault | None:
    """Readings that repeat the one before, where rounding does not make them do so."""
    if ROUNDING in looked.nats:
        return None
    pairs = zip(looked.records, looked.moves, strict=True)
    masks = [repeats(record.y_or_nan, d, looked.innovation) for record, d in pairs]
    share = float(np.mean(np.concatenate(masks)))
    if share <= REPEAT_SHARE:
        return None
    return Fault(TIMING, CERTAIN_NATS, {f"{TIMING}.share_repeated": share}, _masking(masks))


def in_a_rhythm(looked: Looked) -> Fault | None:
    """Readings that are worse at every m-th sample, by their innovations or else by their errors: slow error
    hides a rhythm of errors, noise that follows itself from sample to sample smears one of innovations. Where
    errors follow each other, classes of samples differ less by chance than independent ones do. Readings far
    off do not count."""
    far = glitches(looked.errors, looked.rounding_error)
    near = [np.where(m, running_median(e), e) for e, m in zip(looked.errors, far.masks, strict=True)]
    told = [
        np.isfinite(w) & of_fit & ~mask
        for w, of_fit, mask in zip(looked.weights, looked.fit.response.told, far.masks, strict=True)
    ]
    by_either = (rhythm(errors, told) for errors in (whitened(looked.fit.point, near), near))
    found = next((one for one in by_either if one.present), None)
    if found is None:
        return None
    weights = [found.weights(len(record)) for record in looked.records]
    return Fault(OTHER, found.nats, {EVERY: float(found.every)}, weights)


def held(looked: Looked) -> Fault | None:
    """Angles that were held for some samples beneath noise of their own, but in no rhythm: what is stale by
    turns is not the whole angle, or not by chance."""
    if OTHER in looked.nats:
        return None
    found = held_angles(looked.errors, looked.angles, looked.rounding_error)
    if not found.present:
        return None
    return Fault(TIMING, found.nats, {f"{TIMING}.share_held": found.share}, _masking(found.masks))


def far_off(looked: Looked) -> Fault | None:
    """Single readings far from their neighbours."""
    found = glitches(looked.errors, looked.rounding_error)
    if not found.present:
        return None
    sizes = np.concatenate([e[m] for e, m in zip(looked.residuals, found.masks, strict=True)])
    parameters = {
        f"{GLITCHES}.rate": found.count / sum(len(record) for record in looked.records),
        f"{GLITCHES}.size": float(np.sqrt(np.mean(sizes**2))),
    }
    return Fault(GLITCHES, found.nats, parameters, _masking(found.masks))


def rounded_beneath(looked: Looked) -> Fault | None:
    """Readings rounded before their noise, where no other fault but glitches is seen."""
    if looked.nats.keys() - {GLITCHES}:
        return None
    told = [np.isfinite(w) for w in looked.weights]
    found = rounded_motion(
        [e[k] for e, k in zip(looked.residuals, told, strict=True)],
        [angle[k] for angle, k in zip(looked.angles, told, strict=True)],
        looked.innovation,
    )
    if found is None:
        return None
    return Fault(ROUNDING, found.nats, {f"{ROUNDING}.step": found.step}, step=found.step)


def mistimed(looked: Looked) -> Fault | None:
    """Noise that grows with the speed, where nothing is far off, rounded beneath the noise or in a rhythm,
    which are so at any speed; where rounding shows, at speeds of some of its step a sample: what it adds
    grows as the axis begins to move."""
    if looked.rounded_first or {GLITCHES, OTHER} & looked.nats.keys():
        return None
    residuals = [np.where(w > 1, 0.0, e) for e, w in zip(looked.residuals, looked.weights, strict=True)]
    noise = speed_noise(looked.fit, residuals, MOVING_SHARE * np.sqrt(12) * looked.rounding_error)
    if not noise.present:
        return None
    variance, jitter = looked.innovation**2, noise.jitter**2
    mean_square = float(np.mean(np.concatenate(looked.moves) ** 2))
    level = max(variance - jitter * mean_square, LEAST_LEVEL * variance)
    weights = [np.sqrt(1 + jitter * d**2 / level) for d in looked.moves]
    return Fault(
        TIMING, noise.nats, {f"{TIMING}.sd": noise.jitter / looked.records[0].sample_rate_hz}, weights
    )


PARTS: Sequence[Callable[[Looked], Fault | None]] = (
    rounded,
    repeated,
    in_a_rhythm,
    held,
    far_off,
    rounded_beneath,
    mistimed,
)
"""In the order in which they are looked for: each looks at what those before it leave."""


def _masking(masks: Sequence[BoolArray]) -> list[FloatArray]:
    """Weights that leave out what is masked."""
    return [np.where(mask, MASK, 1.0) for mask in masks]
