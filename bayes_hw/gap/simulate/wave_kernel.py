"""Compiled waves of an axis' position and what w makes of them, a group of LANES frequencies at once."""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.gap.simulate.state_kernel import output_of, stepped
from bayes_hw.model.lane_functions import absolute, cosine, sine, where_less
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, load, store


@compiled(nogil=True)
def turns_of(angles, turns):  # type: ignore[no-untyped-def]
    """Fill turns (samples, 2 LANES) with the cosines, then sines of 0, 1, ... LANES - 1 times `angles`."""
    for k in range(len(angles)):
        by, across = np.cos(angles[k]), np.sin(angles[k])
        real, imaginary = 1.0, 0.0
        for j in range(LANES):
            turns[k, j], turns[k, LANES + j] = real, imaginary
            real, imaginary = real * by - imaginary * across, real * across + imaginary * by


@compiled_inside
def _factors_of_samples(frequency, places, moves, scale, nodes, factors):  # type: ignore[no-untyped-def]
    """Fill factors (2 + nodes, samples in LANES) with the cosine and sine of the wave of `frequency` at
    `places`, times `scale`, and with sinc(move node), all of them (samples in LANES)."""
    groups = len(places)
    for at in range(groups):
        angle = broadcast(2 * np.pi * frequency) * load(places, at)
        store(factors, at, load(scale, at) * cosine(angle))
        store(factors, groups + at, load(scale, at) * sine(angle))
        for i in range(len(nodes)):
            half = broadcast(np.pi * nodes[i]) * load(moves, at)
            mean = where_less(absolute(half), broadcast(1e-300), broadcast(1.0), sine(half) / half)
            store(factors, (2 + i) * groups + at, mean)


@compiled(nogil=True)
def wave_responses(  # type: ignore[no-untyped-def]
    frequency,
    places,
    moves,
    scale,
    turns,
    nodes,
    weights,
    start,
    seen,
    real_count,
    factors_of,
    inputs_of,
    outputs_of,
    responses,
):
    """Fill responses (samples, 2 LANES) with what w makes of sines, then of cosines, of LANES frequencies.

    The first is `frequency`; `turns` (samples, 2 LANES) leads from it to the others. A wave is that at
    `places`, times `scale`, times its mean over `moves` (all in rows of LANES samples): sinc of the
    frequencies `nodes` weighed by `weights` (nodes, LANES). Less `start` (2, LANES) it drives the states (n,)
    of `filter_lanes` from rest; where there are none it is added to w itself. Zero where not `seen`.
    """
    samples, count, n = len(responses), len(nodes), len(factors_of)
    factors, inputs, outputs = aligned_rows(n), aligned_rows(n), aligned_rows(n)
    by_sine, by_cosine = aligned_rows(n), aligned_rows(n)
    for i in range(n):
        store(factors, i, broadcast(factors_of[i]))
        store(inputs, i, broadcast(inputs_of[i]))
        store(outputs, i, broadcast(outputs_of[i]))
    by_sine[:] = 0.0
    by_cosine[:] = 0.0
    of_samples = aligned_rows((2 + count) * len(places))
    _factors_of_samples(frequency, places, moves, scale, nodes, of_samples)
    flat = of_samples.reshape((2 + count, len(places) * LANES))
    start_sine, start_cosine = load(start, 0), load(start, 1)
    for k in range(samples):
        mean = broadcast(0.0)
        for i in range(count):
            mean = mean + broadcast(flat[2 + i, k]) * load(weights, i)
        first_cosine, first_sine = broadcast(flat[0, k]), broadcast(flat[1, k])
        by, across = load(turns, 2 * k), load(turns, 2 * k + 1)
        wave_sine = (first_cosine * across + first_sine * by) * mean - start_sine
        wave_cosine = (first_cosine * by - first_sine * across) * mean - start_cosine
        shown = broadcast(seen[k])
        if n == 0:
            store(responses, 2 * k, shown * wave_sine)
            store(responses, 2 * k + 1, shown * wave_cosine)
        else:
            store(responses, 2 * k, shown * output_of(0, outputs, by_sine))
            store(responses, 2 * k + 1, shown * output_of(0, outputs, by_cosine))
            stepped(factors, inputs, 0, wave_sine, real_count, by_sine)
            stepped(factors, inputs, 0, wave_cosine, real_count, by_cosine)


@compiled(nogil=True)
def add_products(white, products):  # type: ignore[no-untyped-def]
    """Add to products (3, LANES) those of sines and of cosines with themselves, and of sines with cosines,
    given the sines and then the cosines white (samples, 2 LANES)."""
    sines, cosines, across = load(products, 0), load(products, 1), load(products, 2)
    for k in range(len(white)):
        by_sine, by_cosine = load(white, 2 * k), load(white, 2 * k + 1)
        sines = sines + by_sine * by_sine
        cosines = cosines + by_cosine * by_cosine
        across = across + by_sine * by_cosine
    store(products, 0, sines)
    store(products, 1, cosines)
    store(products, 2, across)
