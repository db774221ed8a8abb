"""Where the gap lies: by block, by band, by regime, by time, all of the base model's residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import coherence

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.answer.decide import Decision
from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.criticism.change_points import ChangePoint, change_points
from bayes_hw.gap.effects.labels import LABEL_BLOCKS, Block
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.spectra import mean_spectrum
from bayes_hw.gap.search.attribute import Attribution
from bayes_hw.gap.simulate import settings as S  # noqa: N812

EXCESS_SHARE = 0.8
"""Of the power above the noise floor that the named band holds."""

SEGMENTS = 12
EVERYWHERE = "all"
"""The regime of every sample."""

THIRDS = ("lower third of the travel", "middle third of the travel", "upper third of the travel")


@dataclass(frozen=True)
class Location:
    """`block` and the probability that the cause enters at each; the band in Hz; the regime where the error
    is largest and every regime's mean square over the noise's; coherences of the residual with functions of
    the command; rms of time segments in units of the noise; when the error's size changes for good."""

    block: str
    share: Mapping[str, float]
    band_hz: tuple[float, float]
    regime: str
    regimes: Mapping[str, float]
    coherences: Mapping[str, float]
    segments: tuple[float, ...]
    change_points: tuple[ChangePoint, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """As in verdict.json."""
        return {
            "block": self.block,
            "share": dict(self.share),
            "band_hz": list(self.band_hz),
            "regime": self.regime,
            "regimes": dict(self.regimes),
            "coherence": dict(self.coherences),
            "segments": list(self.segments),
            "change_points": [point.to_dict() for point in self.change_points],
        }


def locate(
    attribution: Attribution, decision: Decision, inputs: Sequence[FloatArray], sigma: float
) -> Location:
    """The gap of the base fit that a decision explains, with `sigma` (output units) of the noise."""
    base = attribution.base.fit
    effects = [effect for e in attribution.explanations for effect in e.fit.hypothesis.effects]
    blocks = {**LABEL_BLOCKS, **{effect.label: effect.block for effect in effects}}
    named = [blocks[label] for label in decision.answer if label != OTHER]
    block = "none"
    if decision.answer:
        block = max(named or decision.blocks, key=lambda b: decision.blocks.get(b, 0.0))
    regimes = regime_ratios(base, inputs, sigma)
    rate = base.hypothesis.scale.rate
    lengths = [np.array_split(e, SEGMENTS) for e in base.residuals]
    segments = tuple(
        float(np.sqrt(np.mean(np.concatenate([parts[i] for parts in lengths]) ** 2)) / sigma)
        for i in range(SEGMENTS)
    )
    return Location(
        block,
        block_shares(decision, blocks),
        excess_band(base, rate),
        max(regimes, key=lambda r: regimes[r]) if regimes else EVERYWHERE,
        regimes,
        command_coherences(base, inputs, rate),
        segments,
        change_points(base.residuals, rate),
    )


def block_shares(decision: Decision, blocks: Mapping[str, Block]) -> dict[str, float]:
    """Probability that the cause enters at each block, two causes counted half each.

    Where the answer is `other`, that is what functions that name no cause say, given that it is right. Else
    labels have their probability at their own of `blocks`, and that of `other` goes to the blocks as those
    functions say; what is missing to one is that there is no gap.
    """
    if decision.answer == (OTHER,):
        return dict(decision.blocks)
    probability = decision.probability
    found = {block: probability[OTHER] * share for block, share in decision.blocks.items()}
    for label, block in blocks.items():
        found[block] = found.get(block, 0.0) + probability.get(label, 0.0)
    total = max(sum(found.values()), 1.0)
    return {block: value / total for block, value in found.items()}


def excess_band(base: Fit, rate: float) -> tuple[float, float]:
    """The shortest band that holds most of the residual's power above its floor at high frequency."""
    spectrum = mean_spectrum(base.residuals, rate)
    order = np.argsort(spectrum.frequencies)
    f, p, n = spectrum.frequencies[order], spectrum.power[order], spectrum.counts[order]
    floor = float(np.median(p[-max(len(p) // 5, 3) :]))
    excess = np.cumsum(np.maximum(p - floor, 0.0) * n)
    if excess[-1] <= 0:
        return (float(f[0]), float(f[-1]))
    excess = excess / excess[-1]
    low, high, best = 0, len(f) - 1, np.inf
    for i in range(len(f)):
        start = excess[i - 1] if i else 0.0
        j = int(np.searchsorted(excess, start + EXCESS_SHARE))
        if j < len(f) and np.log(f[j] / f[i]) < best:
            low, high, best = i, j, np.log(f[j] / f[i])
    return (float(f[low]), float(f[high]))


def regime_masks(base: Fit, inputs: Sequence[FloatArray]) -> dict[str, list[BoolArray]]:
    """Samples of every regime, a mask a record; thirds are those of the travel of all records."""
    scale = base.hypothesis.scale
    chain = base.hypothesis.chain(base.values)
    settings, delay = base.hypothesis.settings(base.values, chain), chain.delay_samples
    masks: dict[str, list[BoolArray]] = {name: [] for name in ("saturated", "slow", "reversing", "dead zone")}
    travelled = np.concatenate(base.simulated)
    edges = travelled.min() + np.ptp(travelled) * np.arange(4) / 3
    for name, low, high in zip(THIRDS, [-np.inf, *edges[1:3]], [*edges[1:3], np.inf], strict=True):
        masks[name] = [(low <= y) & (y < high) for y in base.simulated]
    for u, y in zip(inputs, base.simulated, strict=True):
        command = np.concatenate([np.zeros(delay), u[: len(u) - delay]])
        speed = np.gradient(y) * scale.rate
        usual = float(np.sqrt(np.mean(speed**2)))
        masks["saturated"].append((command < settings[S.LOWER]) | (command > settings[S.UPPER]))
        masks["slow"].append(np.abs(speed) < 0.1 * usual)
        turning = np.concatenate([[False], np.sign(speed[1:]) * np.sign(speed[:-1]) < 0])
        near = np.convolve(turning, np.ones(max(int(0.5 * scale.rate), 1)), "full")[: len(y)] > 0
        masks["reversing"].append(near)
        masks["dead zone"].append(np.abs(y) < 0.5 * settings[S.DEAD_ZONE])
    return masks


def regime_ratios(base: Fit, inputs: Sequence[FloatArray], sigma: float) -> dict[str, float]:
    """Mean square of the residual over the noise's in every regime that the records visit."""
    e = np.concatenate(base.residuals)
    found = {EVERYWHERE: float(np.mean(e**2) / sigma**2)}
    for name, masks in regime_masks(base, inputs).items():
        mask = np.concatenate(masks)
        if mask.sum() >= 20:
            found[name] = float(np.mean(e[mask] ** 2) / sigma**2)
    return found


def command_coherences(base: Fit, inputs: Sequence[FloatArray], rate: float) -> dict[str, float]:
    """Mean squared coherence of the residual with u, u^2, |u| and the sign of the speed."""
    found: dict[str, float] = {}
    for name in ("u", "u^2", "|u|", "sign of speed"):
        values = []
        for u, y, e in zip(inputs, base.simulated, base.residuals, strict=True):
            speed = np.gradient(y)
            signal = {"u": u, "u^2": u**2, "|u|": np.abs(u), "sign of speed": np.sign(speed)}[name]
            if np.ptp(signal) == 0:
                continue
            _, squared = coherence(signal - signal.mean(), e - e.mean(), rate, nperseg=min(256, len(u) // 4))
            values.append(float(np.nanmean(squared)))
        found[name] = float(np.mean(values)) if values else 0.0
    return found
