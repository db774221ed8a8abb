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
from typing import NamedTuple

import numpy as np
from scipy.signal import fftconvolve

from bayes_hw.arrays import FloatArray, highest_peaks
from bayes_hw.gap.effects.effect import PeriodicEffect
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.simulate.builder import SignalChain
from bayes_hw.gap.simulate.injection_point import NO_STATES, InjectionPoint, InjectionStates
from bayes_hw.gap.simulate.wave_kernel import add_products, turns_of, wave_responses
from bayes_hw.model.lanes import LANES, filled_up

CHUNK = 3 * LANES
"""Periods between which the mean of a wave over a sample is interpolated."""

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
        return [int(i) for i in highest_peaks(self.reductions)]


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
    waves = _waves(base, effect, frequencies, positions)
    bounds = np.cumsum([len(e) for e in base.residuals])[:-1]
    held_against = np.split(np.concatenate([tangents, residual[:, None]], axis=1), bounds)
    parts = []
    for group in _groups(frequencies):
        sums = _Sums(held_against[0].shape[1])
        for record, (own, fixed) in enumerate(zip(waves, held_against, strict=True)):
            sums.add(whitener.whiten(own.responses(group), record), fixed)
        parts.append(sums.reduced())
    reductions, amplitudes = zip(*parts, strict=True)
    count = len(frequencies)
    return PeriodScan(np.concatenate(reductions)[:count], np.concatenate(amplitudes, axis=1)[:, :count])


class _Group(NamedTuple):
    """Equally spaced `frequencies` (LANES,), and how the mean of a wave over a sample is that of waves of
    the frequencies `nodes` weighed by `weights` (nodes, LANES)."""

    frequencies: FloatArray
    nodes: FloatArray
    weights: FloatArray


def _groups(frequencies: FloatArray) -> list[_Group]:
    """The frequencies in groups of LANES, the last one filled up with its last frequency."""
    found = []
    for start in range(0, len(frequencies), CHUNK):
        chunk = frequencies[start : start + CHUNK]
        nodes, weights = _means_between(chunk)
        filled, weights = filled_up(chunk), filled_up(weights)
        for first in range(0, len(filled), LANES):
            lanes = slice(first, first + LANES)
            found.append(_Group(filled[lanes], nodes, np.ascontiguousarray(weights[:, lanes])))
    return found


def _means_between(frequencies: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes (nodes,) and weights (nodes, n) by which sinc(move f) at n `frequencies` is that at the nodes.

    Between four of the frequencies, which lie close together, it is a cubic.
    """
    if len(frequencies) <= NODES:
        return frequencies, np.eye(len(frequencies))
    nodes = np.linspace(frequencies[0], frequencies[-1], NODES)
    centre, span = nodes.mean(), np.ptp(nodes)
    powers, at_nodes = (np.vander((f - centre) / span, NODES) for f in (frequencies, nodes))
    return nodes, np.asarray(np.linalg.solve(at_nodes.T, powers.T))


@dataclass(frozen=True)
class _Waves:
    """The waves of one record on their way to its output.

    `places`, `moves` and `scale`, in rows of LANES samples, are the middle of every sample's way, the way and
    what the wave is multiplied by there; `turns` (samples, 2 LANES) lead from one frequency to the next,
    `seen` (samples,) is zero where the encoder sees no motion. The wave at `rest`, a position, is taken off
    where there is one. They drive `states`, or are convolved with the answer `to_pulse` (samples,) to one.
    """

    places: FloatArray
    moves: FloatArray
    scale: FloatArray
    turns: FloatArray
    seen: FloatArray
    rest: float | None
    states: InjectionStates
    to_pulse: FloatArray | None

    def responses(self, group: _Group) -> FloatArray:
        """What is seen (samples, 2 LANES) of the sines of `group`, then of the cosines."""
        responses, start = np.empty_like(self.turns), np.zeros((2, LANES))
        if self.rest is not None:
            angles = 2 * np.pi * group.frequencies * self.rest
            start = np.array([np.sin(angles), np.cos(angles)])
        wave_responses(
            group.frequencies[0],
            self.places,
            self.moves,
            self.scale,
            self.turns,
            group.nodes,
            group.weights,
            start,
            self.seen if self.to_pulse is None else np.ones_like(self.seen),
            *self.states,
            responses,
        )
        if self.to_pulse is None:
            return responses
        answers = fftconvolve(responses, self.to_pulse[:, None], axes=0)[: len(responses)]
        return np.asarray(answers * self.seen[:, None])


def _waves(
    base: Fit, effect: PeriodicEffect, frequencies: FloatArray, positions: Sequence[FloatArray] | None
) -> list[_Waves]:
    """Those of every record at its `positions` (samples,), the simulated ones if not given."""
    hypothesis, values = base.hypothesis, base.values
    chain = hypothesis.chain(values)
    simulated, dead_zone = hypothesis.motion(values)
    spacing = frequencies[1] - frequencies[0] if len(frequencies) > 1 else 0.0
    states = chain.injection_states(effect.door)
    found = []
    for record, w in enumerate(simulated if positions is None else positions):
        move = np.diff(w, append=w[-1]) * (effect.door != "output")
        middle = w + 0.5 * move
        scale, turns = np.ones_like(w), np.empty((len(w), 2 * LANES))
        if effect.only_saturated:
            scale = _limit_reached(hypothesis.commands[record], chain.delay_samples, values)
        turns_of(2 * np.pi * spacing * middle, turns)
        found.append(
            _Waves(
                _in_rows(middle),
                _in_rows(move),
                _in_rows(scale),
                turns,
                (np.abs(simulated[record]) > dead_zone).astype(np.float64),
                None if effect.door == "command" else float(w[0]),
                NO_STATES if states is None else states,
                _answer_to_pulse(chain, effect.door, len(w)) if states is None else None,
            )
        )
    return found


def _in_rows(values: FloatArray) -> FloatArray:
    """Values (samples,) in rows of LANES, the last one repeated to fill them."""
    return np.asarray(filled_up(values).reshape(-1, LANES))


def _answer_to_pulse(chain: SignalChain, door: InjectionPoint, samples: int) -> FloatArray:
    """Change of w (samples,) for a one at `door` in the first sample."""
    return chain.small_responses(door, np.eye(samples, 1))[:, 0]


class _Sums:
    """Inner products of LANES sines and as many cosines, with each other and with k + 1 fixed columns: the
    tangents and the residual."""

    def __init__(self, columns: int) -> None:
        self.products = np.zeros((3, LANES))
        self.along = np.zeros((columns, 2 * LANES))

    def add(self, white: FloatArray, fixed: FloatArray) -> None:
        """Those of one record: `white` (samples, 2 LANES), the sines first, and `fixed` (samples, k + 1)."""
        add_products(np.ascontiguousarray(white), self.products)
        self.along += fixed.T @ white

    def reduced(self) -> tuple[FloatArray, FloatArray]:
        """Reductions (LANES,) and amplitudes (2, LANES) of every sine with its cosine."""
        along = self.along[:-1]
        squares, across = self.products[:2], self.products[2]
        within = np.sum(along**2, axis=0).reshape(2, LANES)
        ss, cc = squares - within + WITHIN_TANGENTS * squares + 1e-300
        sc = across - np.sum(along[:, :LANES] * along[:, LANES:], axis=0)
        se, ce = np.split(self.along[-1], 2)
        determinant = np.maximum(ss * cc - sc**2, 1e-300)
        amplitudes = np.array([(cc * se - sc * ce) / determinant, (ss * ce - sc * se) / determinant])
        return amplitudes[0] * se + amplitudes[1] * ce, amplitudes


def _limit_reached(u: FloatArray, delay: int, values: FloatArray) -> FloatArray:
    """The limit where the delayed command lies beyond it, zero elsewhere; shape of `u`."""
    delayed = np.zeros_like(u)
    delayed[delay:] = u[: len(u) - delay]
    return np.where(delayed < values[0], values[0], np.where(delayed > values[1], values[1], 0.0))
