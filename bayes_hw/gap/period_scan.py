"""A sine of the axis' position, of any period: what it could take of a residual, the periods in one scan.

The response to a small wave A sin(2 pi w / P) + B cos(2 pi w / P) at a door of the axis is linear in A and
B; but for limits the wave is zero where the record starts. Before the encoder it acts by its mean over a
sample, in which the axis may pass much of a short period: that at the middle times sinc(move / P). With its
sine and cosine part s and c and the residual e, whitened and with the base tangents projected off, the
reducible error is (s'e, c'e) times the inverse of their Gram matrix times (s'e, c'e)'. The projection P is
never carried out on the waves: (P s)'(P c) = s'c - (T's)'(T'c) for tangents T of unit length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.effects.effect import PeriodicEffect
from bayes_hw.gap.fit import Fit
from bayes_hw.gap.signals import door_responses
from bayes_hw.gap.whitener import Whitener

CHUNK = 48
"""Periods at once: their waves stay in the cache."""

NODES = 4
"""Frequencies of a chunk at which the mean of a wave over a sample is computed."""

WITHIN_TANGENTS = 1e-9
"""Share of a wave's power that is not counted as outside the base tangents."""


@dataclass(frozen=True)
class PeriodScan:
    """Reductions (n,) in units of twice the log-likelihood, and the amplitudes (2, n) of sine and cosine."""

    reductions: FloatArray
    amplitudes: FloatArray

    def peaks(self) -> list[int]:
        """Where the reduction is that of a local maximum, the largest first."""
        padded = np.concatenate([[-np.inf], self.reductions, [-np.inf]])
        at = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
        return [int(i) for i in at[np.argsort(-self.reductions[at], kind="stable")]]


def scan_periods(
    base: Fit,
    whitener: Whitener,
    tangents: FloatArray,
    residual: FloatArray,
    effect: PeriodicEffect,
    frequencies: FloatArray,
    positions: Sequence[FloatArray] | None = None,
) -> PeriodScan:
    """Waves of `effect` at equally spaced `frequencies` (n,), cycles per unit of position, beside `base`.

    `tangents` (samples, k) have unit length and are orthogonal, `residual` (samples,) is orthogonal to them;
    `positions` (samples,), a record each, are those of the waves, the simulated ones if not given.
    """
    hypothesis, values = base.hypothesis, base.values
    chain = hypothesis.chain(values)
    simulated, dead_zone = hypothesis.motion(values)
    if positions is None:
        positions = simulated
    spacing = frequencies[1] - frequencies[0] if len(frequencies) > 1 else 0.0
    moves = [np.diff(w, append=w[-1]) * (effect.door != "output") for w in positions]
    middles = [w + 0.5 * move for w, move in zip(positions, moves, strict=True)]
    rotations = [_powers(2 * np.pi * spacing * w, min(CHUNK, len(frequencies))) for w in middles]
    bounds = np.cumsum([0, *(len(w) for w in positions)])
    parts = []
    for start in range(0, len(frequencies), CHUNK):
        count = min(CHUNK, len(frequencies) - start)
        sums = _Sums(count, tangents.shape[1])
        chunk = frequencies[start : start + count]
        for record, (middle, rotation) in enumerate(zip(middles, rotations, strict=True)):
            first = np.exp(2j * np.pi * chunk[0] * middle)
            if effect.only_saturated:
                first = first * _limit_reached(hypothesis.inputs[record], chain.delay_samples, values)
            added = first[:, None] * rotation[:, :count] * _means(moves[record], chunk)
            if effect.door != "command":
                added -= np.exp(2j * np.pi * chunk * positions[record][0])
            waves = np.concatenate([added.imag, added.real], axis=1)
            response = door_responses(chain, effect.door, waves)
            response *= (np.abs(simulated[record]) > dead_zone)[:, None]
            rows = slice(bounds[record], bounds[record + 1])
            sums.add(whitener.whiten(response, record), tangents[rows], residual[rows])
        parts.append(sums.reduced())
    reductions, amplitudes = zip(*parts, strict=True)
    return PeriodScan(np.concatenate(reductions), np.concatenate(amplitudes, axis=1))


class _Sums:
    """Inner products of `count` sines and as many cosines, with each other, the residual and k tangents."""

    def __init__(self, count: int, k: int) -> None:
        self.count = count
        self.squares, self.across = np.zeros(2 * count), np.zeros(count)
        self.towards, self.along = np.zeros(2 * count), np.zeros((k, 2 * count))

    def add(self, white: FloatArray, tangents: FloatArray, residual: FloatArray) -> None:
        """Those of one record: `white` (samples, 2 count), the sines first."""
        self.squares += np.einsum("ij,ij->j", white, white)
        self.across += np.einsum("ij,ij->j", white[:, : self.count], white[:, self.count :])
        self.towards += residual @ white
        self.along += tangents.T @ white

    def reduced(self) -> tuple[FloatArray, FloatArray]:
        """Reductions (count,) and amplitudes (2, count) of every sine with its cosine."""
        outside = self.squares - np.sum(self.along**2, axis=0) + WITHIN_TANGENTS * self.squares + 1e-300
        ss, cc = outside[: self.count], outside[self.count :]
        sc = self.across - np.sum(self.along[:, : self.count] * self.along[:, self.count :], axis=0)
        se, ce = self.towards[: self.count], self.towards[self.count :]
        determinant = np.maximum(ss * cc - sc**2, 1e-300)
        amplitudes = np.array([(cc * se - sc * ce) / determinant, (ss * ce - sc * se) / determinant])
        return amplitudes[0] * se + amplitudes[1] * ce, amplitudes


def _means(moves: FloatArray, frequencies: FloatArray) -> FloatArray:
    """sinc(move f) (samples, frequencies): the mean over a sample, relative to the middle, of a wave of
    frequency f past which the axis moves by `moves` (samples,). Between four of the frequencies, which lie
    close together, it is a cubic."""
    if len(frequencies) <= NODES:
        return np.asarray(np.sinc(moves[:, None] * frequencies))
    nodes = np.linspace(frequencies[0], frequencies[-1], NODES)
    centre, span = nodes.mean(), np.ptp(nodes)
    powers, at_nodes = (np.vander((f - centre) / span, NODES) for f in (frequencies, nodes))
    return np.asarray(np.sinc(moves[:, None] * nodes) @ np.linalg.solve(at_nodes.T, powers.T))


def _powers(angles: FloatArray, count: int) -> ComplexArray:
    """exp(i j angle) for j below `count`, (samples, count)."""
    turns = np.empty((len(angles), count), dtype=np.complex128)
    turns[:, 0], turn = 1.0, np.exp(1j * angles)
    for j in range(1, count):
        turns[:, j] = turns[:, j - 1] * turn
    return turns


def _limit_reached(u: FloatArray, delay: int, values: FloatArray) -> FloatArray:
    """The limit where the delayed command lies beyond it, zero elsewhere; shape of `u`."""
    delayed = np.zeros_like(u)
    delayed[delay:] = u[: len(u) - delay]
    return np.where(delayed < values[0], values[0], np.where(delayed > values[1], values[1], 0.0))
