"""The measured frequency response from velocity command to output: local polynomial method.

Around each frequency the spectra Z of the output's rate and V of the command obey

    Z_i(f) = G(f) V_i(f) + T_i(f) + E_i(f),

G smooth and common to all records i, T_i smooth and each record's own: the free response at its ends, which
a window smears and a Welch average counts as noise. Both are polynomials over a few neighbouring lines; what
they leave is E, and its variance gives the band (Pintelon, Schoukens, Vandersteen and Barbe,
doi 10.1016/j.ymssp.2009.08.009). E holds noise and what a nonlinear axis adds to its best linear
approximation, so the band does too. The rate, not the angle, is regressed because an integrator's response
is no polynomial at low frequency; the angle's response is G(f) over the difference's own, exactly.

Welch's method was not taken: its bands leave out the leakage of an integrator and of short sweeps, which do
not repeat within a segment. Multitapers keep the leakage small but not the transient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft, ndimage, special

from bayes_hw.arrays import ComplexArray, FloatArray

PROBABILITY = 0.94
TRANSIENT_WEIGHTS = (1e-3, 1.0, 10.0, 1e2, 1e3, 1e5, 1e8)
"""Prior variances of T's coefficients that are tried, in units of the noise's."""

TRANSIENT_DECAY = 0.5
"""Prior standard deviation of each coefficient of T in units of that of one degree less."""

WEIGHT_NEIGHBOURS = 8
CENTRE_VARIANCE = 2.25
"""Variance of a parabola's value at the middle of many points, in units of the mean's."""

TINY = float(np.finfo(np.float64).tiny)
DEGREE = 2
FREEDOM = 5
"""Complex degrees of freedom that are left to the residuals, at least."""

EDGE = 0.6
"""Nearer to zero and to half the sample rate, in half widths of the window, nothing is estimated: a window
that ends there would extrapolate.
"""

MOST_FREQUENCIES = 400
LEAST_SAMPLES = 64
SPARE = 0.75
"""Half width of a window in steps between frequencies, where records are long: neighbours hardly overlap."""


COHERENCE_NEIGHBOURS = 4
TRUSTED = 0.3
"""Coherence above which a phase is followed, and a response worth drawing."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Response of the output to the velocity command at `frequency_hz`; all arrays have that shape.

    `response` is complex, in output units over command units (for deg and deg/s: s); `lower` and `upper`
    bound its magnitude with probability 0.94. `coherence` is the share of the rate's power that the command
    explains linearly. `noise_density` is the two-sided spectral density of what is left of the rate,
    (output unit/s)^2 / Hz.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    lower: FloatArray
    upper: FloatArray
    coherence: FloatArray
    noise_density: FloatArray
    sample_rate_hz: float

    @property
    def magnitude(self) -> FloatArray:
        return np.abs(self.response)

    @property
    def phase_deg(self) -> FloatArray:
        """Unwrapped from one coherent frequency to the next; those between lie within half a turn of the
        last.
        """
        turns = np.angle(self.response) / (2 * np.pi)
        last = turns[0]
        for k, coherence in enumerate(self.coherence):
            turns[k] -= np.round(turns[k] - last)
            last = turns[k] if coherence > TRUSTED else last
        return 360 * turns

    @property
    def rate_factor(self) -> FloatArray:
        """What the response to the rate is larger by: |exp(i w) - 1| times the sample rate."""
        return np.abs(difference(self.frequency_hz, self.sample_rate_hz)) * self.sample_rate_hz


def difference(frequency_hz: FloatArray, sample_rate_hz: float) -> ComplexArray:
    """Response of y(k) - y(k-1)."""
    return 1 - np.exp(-2j * np.pi * frequency_hz / sample_rate_hz)


@dataclass(frozen=True, eq=False)
class Spectra:
    """Half-sided spectra of one stretch of samples, lines (lines,) in Hz, divided by sqrt(samples)."""

    lines: FloatArray
    rate: ComplexArray
    command: ComplexArray

    @property
    def step(self) -> float:
        return float(self.lines[1])


def spectra(rate: FloatArray, command: FloatArray, sample_rate_hz: float) -> Spectra:
    """Of two signals of one length."""
    samples = len(rate)
    lines = np.asarray(fft.rfftfreq(samples, 1 / sample_rate_hz))
    scale = 1 / np.sqrt(samples)
    return Spectra(lines, fft.rfft(rate) * scale, fft.rfft(command) * scale)


def frequency_response(
    outputs: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    sample_rate_hz: float,
    most_frequencies: int = MOST_FREQUENCIES,
) -> FrequencyResponse | None:
    """Of stretches of samples, each pair of one length; None where all are shorter than LEAST_SAMPLES."""
    parts = [
        spectra(np.diff(y, prepend=y[:1]) * sample_rate_hz, v, sample_rate_hz)
        for y, v in zip(outputs, commands, strict=True)
        if len(y) > LEAST_SAMPLES
    ]
    if not parts:
        return None
    grid = frequencies(parts, most_frequencies)
    tables = np.array(
        [_local_fits(parts, float(f), float(step)) for f, step in zip(grid, np.gradient(grid), strict=True)]
    )
    kept = np.isfinite(tables[:, :, 0]).all(axis=1)
    if not kept.any():
        return None
    found = grid[kept]
    table = averaged(tables[kept, :, 1:], _smooth(tables[kept, :, 0].real, WEIGHT_NEIGHBOURS))
    rate_response = table[:, 0]
    variance, command_power, noise, freedom = table[:, 1:].real.T
    signal = np.maximum(np.abs(rate_response) ** 2 - variance, 0.0) * command_power
    response = rate_response / (difference(found, sample_rate_hz) * sample_rate_hz)
    magnitude = np.sqrt(np.maximum(np.abs(rate_response) ** 2 - variance / 2, 0.0))
    signal, smooth_noise = (_smooth(p, COHERENCE_NEIGHBOURS) for p in (signal, noise))
    half = special.stdtrit(2 * freedom, 0.5 + PROBABILITY / 2) * np.sqrt(variance / 2)
    factor = np.abs(difference(found, sample_rate_hz)) * sample_rate_hz
    return FrequencyResponse(
        frequency_hz=found,
        response=response,
        lower=np.maximum(magnitude - half, 0.0) / factor,
        upper=(magnitude + half) / factor,
        coherence=signal / (signal + smooth_noise),
        noise_density=noise / sample_rate_hz,
        sample_rate_hz=sample_rate_hz,
    )


def frequencies(parts: Sequence[Spectra], most: int) -> FloatArray:
    """Every line of the longest stretch from its first on; where these are more than `most`, evenly spaced
    in the square root of frequency, so that no decade is empty.
    """
    longest = min(parts, key=lambda part: part.step)
    lines = longest.lines[1:-1]
    if len(lines) <= most:
        return lines
    wanted = np.linspace(np.sqrt(lines[0]), np.sqrt(lines[-1]), most) ** 2
    return lines[np.unique(np.round(wanted / longest.step).astype(int) - 1)]


def averaged(tables: ComplexArray, criterion: FloatArray) -> ComplexArray:
    """The fits under all prior weights averaged by their likelihoods; the variance holds the spread between
    them.

    Shapes (frequencies, weights, 5) and (frequencies, weights); criterion is minus a log-likelihood.
    """
    likelihood = np.exp(criterion.min(axis=1, keepdims=True) - criterion)
    share = likelihood / likelihood.sum(axis=1, keepdims=True)
    mean = np.einsum("ij,ijk->ik", share, tables)
    mean[:, 1] += np.sum(share * np.abs(tables[:, :, 0] - mean[:, :1]) ** 2, axis=1)
    return mean


def _smooth(values: FloatArray, neighbours: int) -> FloatArray:
    """Mean along the first axis over `neighbours` on either side, so that a chance error of one estimate
    moves what is decided about it little: those above a threshold would else be the ones that came out too
    large.
    """
    size = (2 * neighbours + 1, *(1,) * (values.ndim - 1))
    return np.asarray(ndimage.uniform_filter(values, size, mode="nearest"))


def _local_fits(parts: Sequence[Spectra], frequency: float, spacing: float) -> ComplexArray:
    """A row for every prior weight of T, shape (weights, 6); not finite where the fit is impossible.

    A row is the criterion, rate response, its variance, power of the command, power of the noise, degrees of
    freedom. The command's power is what it is worth beside T: that of a rough command with which G would have
    this variance. The criterion is minus the restricted log-likelihood of the weight.
    """
    terms = DEGREE + 1
    impossible = np.full((len(TRANSIENT_WEIGHTS), 6), np.nan, dtype=np.complex128)
    coarsest = max(part.step for part in parts)
    density = sum(coarsest / part.step for part in parts)
    reach = max(SPARE * spacing, coarsest * (terms * (1 + len(parts)) + FREEDOM) / density / 2)
    highest = min(float(part.lines[-1]) for part in parts)
    if min(frequency, highest - frequency) < EDGE * reach:
        return impossible
    windows = [_window(part, frequency, reach) for part in parts]
    chosen = [(part, w) for part, w in zip(parts, windows, strict=True) if w.stop > w.start]
    rows = sum(w.stop - w.start for _, w in chosen)
    free, freedom = terms * len(chosen), rows - terms
    if freedom < 3:
        return impossible
    width = free + terms
    table = np.zeros((len(TRANSIENT_WEIGHTS), rows + free, width + 1), dtype=np.complex128)
    row = 0
    for index, (part, window) in enumerate(chosen):
        offset = (part.lines[window] - frequency) / reach
        basis = np.vander(offset, terms, increasing=True)
        place = slice(row, row + len(offset))
        table[:, place, terms * index : terms * (index + 1)] = basis
        table[:, place, free:width] = basis[:, ::-1] * part.command[window, None]
        table[:, place, width] = part.rate[window]
        row += len(offset)
    decays = np.tile(TRANSIENT_DECAY ** np.arange(terms), len(chosen))
    scales = np.sqrt(np.array(TRANSIENT_WEIGHTS))[:, None] * decays
    table[:, rows + np.arange(free), np.arange(free)] = 1 / scales
    triangle = np.asarray(np.linalg.qr(table, mode="r"))
    diagonal = np.abs(np.diagonal(triangle, axis1=1, axis2=2))[:, :width]
    if (diagonal[:, free:].min(axis=1) <= 1e-10 * diagonal[:, free:].max(axis=1)).any():
        return impossible
    noise = np.maximum(np.abs(triangle[:, -1, -1]) ** 2, TINY) / freedom
    information = diagonal[:, -1] ** 2
    criterion = freedom * np.log(noise) + 2 * (np.log(diagonal).sum(axis=1) + np.log(scales).sum(axis=1))
    response = triangle[:, width - 1, width] / triangle[:, width - 1, width - 1]
    power = CENTRE_VARIANCE * information / rows
    return np.column_stack(
        [criterion, response, noise / information, power, noise, np.full(len(noise), float(freedom))]
    )


def _window(part: Spectra, frequency: float, reach: float) -> slice:
    """Lines within `reach`, moved inside at the ends of the spectrum; the lines at zero and Nyquist are
    real and left out.
    """
    first, last = 1, len(part.lines) - 1
    low = int(np.ceil((frequency - reach) / part.step - 1e-9))
    high = int(np.floor((frequency + reach) / part.step + 1e-9)) + 1
    if low < first:
        low, high = first, high + first - low
    if high > last:
        low, high = low + last - high, last
    return slice(max(low, first), min(high, last))
