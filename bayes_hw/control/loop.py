"""The position loop of one controller around many draws of an axis, where neither static block bends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray, IntArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.errors import InputError

LOWEST_SHARE = 1e-4
"""Lowest frequency of the grid, as a share of the controller's rate."""

BASE_POINTS = 260
MODE_POINTS = 48
MODE_WIDTHS = 4.0
"""The grid is dense this many half-power widths to either side of every resonance."""

ON_CIRCLE = 1e-9


@dataclass(frozen=True, eq=False)
class Loop:
    """L(z) = C(z) G(z), the command held between the controller's periods (see `AxisDraws.held`).

    `axis` holds the draws at the model's own rate. Raises InputError when the rates do not divide, or nothing
    in the loop delays: a command cannot depend on the output that it changes at once.
    """

    axis: AxisDraws
    controller: Controller

    def __post_init__(self) -> None:
        held = self.held
        if held.delay_samples + self.controller.delay_samples == 0 and np.any(held.direct != 0):
            raise InputError(
                f"controller {self.controller.name!r}: G answers within the same sample, so that the loop "
                "needs a delay; set delay_samples to 1 or more"
            )

    @cached_property
    def held(self) -> AxisDraws:
        """The axis at the controller's rate."""
        return self.axis.held(self.controller.ratio_to(self.axis.sample_rate_hz))

    @property
    def nyquist_hz(self) -> float:
        return self.controller.sample_rate_hz / 2

    @cached_property
    def frequency_hz(self) -> FloatArray:
        """The grid of `frequency_grid` for this loop, up to the controller's Nyquist frequency."""
        rate = self.controller.sample_rate_hz
        if rate not in self.axis.grids:
            self.axis.grids[rate] = frequency_grid(self.axis, rate)
        return self.axis.grids[rate]

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """L at every frequency, shape (draws, frequencies)."""
        gain = self.axis.loop_gain * self.controller.response(frequency_hz)
        return np.asarray(gain * self.held.response(frequency_hz), dtype=np.complex128)

    def response_at(self, index: IntArray, frequency_hz: FloatArray) -> ComplexArray:
        """L of draw index[i] at frequency_hz[i], shape (points,)."""
        gain = self.axis.loop_gain * self.controller.response(frequency_hz)
        return np.asarray(gain * self.held.response_at(index, frequency_hz), dtype=np.complex128)

    def matrices(self, factor: FloatArray | float = 1.0) -> FloatArray:
        """State matrices of the closed loop with `factor` ((draws,) or one number) in front of L.

        Shape (draws, states, states). In modal form, whose eigenvalues keep their digits where poles of G
        cluster at z = 1 and those of its polynomial do not.
        """
        axis, controller = self.held, self.controller.state_space()
        n_real, n_pairs = len(axis.real_poles), len(axis.pair_poles)
        delay = axis.delay_samples + self.controller.delay_samples
        plant = n_real + 2 * n_pairs
        states = plant + delay + controller.order
        a = np.zeros((axis.count, states, states))
        output = np.zeros((axis.count, states))
        entry = np.zeros(states)
        for i in range(n_real):
            a[:, i, i] = axis.real_poles[i]
            output[:, i] = axis.real_residues[i]
            entry[i] = 1
        for m in range(n_pairs):
            i = n_real + 2 * m
            pole, residue = axis.pair_poles[m], axis.pair_residues[m]
            a[:, i, i], a[:, i, i + 1] = pole.real, -pole.imag
            a[:, i + 1, i], a[:, i + 1, i + 1] = pole.imag, pole.real
            output[:, i], output[:, i + 1] = 2 * residue.real, -2 * residue.imag
            entry[i] = 1
        if delay:
            output[:, plant + delay - 1] = axis.direct
            a[:, :, plant + delay - 1] += entry
            for j in range(1, delay):
                a[:, plant + j, plant + j - 1] = 1
            entry = np.zeros(states)
            entry[plant] = 1
        output = -output * self.axis.loop_gain * np.reshape(factor, (-1, 1))
        command = controller.d * output
        first = plant + delay
        command[:, first:] += controller.c
        a += entry[None, :, None] * command[:, None, :]
        a[:, first:, first:] += controller.a
        a[:, first:, :] += controller.b[:, None] * output[:, None, :]
        return a

    def spectral_radius(self, factor: FloatArray | float = 1.0) -> FloatArray:
        """Largest modulus of the closed loop's poles, (draws,); below one where it is stable."""
        return np.asarray(np.abs(np.linalg.eigvals(self.matrices(factor))).max(axis=1), dtype=np.float64)


def frequency_grid(axis: AxisDraws, rate_hz: float, lowest_share: float = LOWEST_SHARE) -> FloatArray:
    """Frequencies in Hz, evenly spaced in the logarithm and dense around the resonances of all draws.

    From `lowest_share` of `rate_hz` up to its half.
    """
    nyquist = rate_hz / 2
    parts = [np.geomspace(lowest_share * rate_hz, nyquist, BASE_POINTS)]
    for poles in axis.pair_poles:
        s = np.log(poles) * axis.sample_rate_hz
        frequency, width = np.abs(s) / (2 * np.pi), -s.real / (2 * np.pi)
        reach = MODE_WIDTHS * float(np.median(width))
        low, high = np.quantile(frequency, [0.005, 0.995])
        parts.append(np.linspace(max(low - reach, lowest_share * rate_hz), high + reach, MODE_POINTS))
    grid = np.unique(np.concatenate(parts))
    return np.asarray(grid[grid <= nyquist * (1 + ON_CIRCLE)], dtype=np.float64)
