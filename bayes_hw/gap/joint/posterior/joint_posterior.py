"""Posterior of the joint fit: a normal in its coordinates (Laplace), carried to what is reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.joint.fit.chaotic_motion import drawn_about
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.leading_sample import first_samples, leading_draws
from bayes_hw.gap.joint.fit.unreached_limits import unreached_limits
from bayes_hw.gap.joint.posterior.reported_quantities import (
    SAME_MODE,
    base_quantities,
    base_units,
    dominant_sections,
    effect_quantities,
    effect_units,
    linear_block_gain,
    torque_draws,
)
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import residuals_at
from bayes_hw.record import Units

DRAWS = 300
INFLATION = 1.7
"""Of standard deviations, for structures not chosen and forms a little wrong: see
docs/decisions/0016-joint-search.md."""

RIDGE = 1e-9
RIDGES = (1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Least eigenvalues of a correlation matrix, in turn, until a draw is one that the records allow."""

UNSEEN = 1e-7
"""Least eigenvalue of that matrix where nothing is simulated: below it a direction is numbers that cancel.
Standard deviations of limits, dead zone and dominant modes are the same from 1e-7 to 1e-3 of it at 20 Hz; at
200 Hz, where weights of one pole all but cancel in all that records tell, those of limits need 1e-7."""

TRIES = 20
"""Normals that a draw may take until its poles are of the fit's kinds."""

CHAOTIC = 1.7
"""Factor on standard deviations where motion is chaotic, so that its torques are held as they are."""

MODE_NUMBERS = 4
"""Of a mode: each costs half the logarithm of the samples (Schwarz 1978, doi 10.1214/aos/1176344136)."""


@dataclass(frozen=True, eq=False)
class JointPosterior:
    """Draws (draws, size) of the coordinates and of the reported quantities by name, with their units;
    `sections` are the numbers of the dominant modes' sections."""

    fit: JointFit
    coordinates: FloatArray
    base: dict[str, FloatArray]
    effects: dict[str, FloatArray]
    units: dict[str, str]
    sections: tuple[int, ...]


def laplace(
    fit: JointFit,
    units: Units,
    rng: np.random.Generator,
    inflation: float = INFLATION,
    sections: Sequence[int] | None = None,
    doubted: bool = False,
) -> JointPosterior:
    """Draws about the fit, standard deviations times `inflation`; `sections` as `dominant_sections` has them
    where they are not to be found anew. Where the fit is `doubted` only modes are reported whose weights the
    records tell from none: beside readings that are rounded or held, or an effect that is not quite what its
    form says, G takes up a little as a resonance, which is none of the axis and would take the number of one
    that is."""
    about, factor, where = drawn_about(fit)
    chaotic = about is not fit
    if chaotic:
        inflation *= CHAOTIC
    size = len(factor) - 1
    largest = np.abs(factor[:size, :size]).max(axis=0)
    seen = largest > 0
    largest[~seen] = 1.0
    scaled = factor[:size, :size] / largest
    norms = np.sqrt(np.sum(scaled**2, axis=0))
    norms[~seen] = 1.0
    correlation = (scaled / norms).T @ (scaled / norms)
    variance = fit.point.variance_by(factor)
    scale = np.where(seen, largest * norms / np.sqrt(variance), np.inf)
    values, vectors = np.linalg.eigh(correlation + RIDGE * np.eye(size))
    drawn = np.tile(fit.point.coordinates, (DRAWS, 1))
    drawn[:, where] = _allowed(about, values, vectors, scale, inflation, rng)
    rate = fit.response.scale.rate_hz
    base: dict[str, list[float]] = {}
    effects: dict[str, list[float]] = {}
    sections = dominant_sections(fit) if sections is None else list(sections)
    every = [fit.response.values(x) for x in drawn]
    whole = _whole_normal(about, sections, values, vectors, scale, inflation, rng)
    if doubted:
        weights = np.array([one.cascade.sections[2:4] for one in whole]) / inflation
        own, asked = fit.values.cascade.sections[2:4], 0.5 * MODE_NUMBERS * np.log(fit.point.samples)
        sections = [i for i in sections if nats_of(own[:, i], weights[:, :, i]) >= asked]
    for values_at in whole:
        for name, value in base_quantities(fit, values_at, sections, rate).items():
            base.setdefault(name, []).append(value)
    for values_at in every:
        for name, value in effect_quantities(fit, values_at).items():
            effects.setdefault(name, []).append(value)
    if chaotic:
        effects = {name: values for name, values in effects.items() if np.ptp(values) > 0}
    effects |= torque_draws(fit, drawn, rng)
    base |= unreached_limits(fit, base, rng)
    first = np.array([first_samples(one) for one in every])
    first[:, 0] = [linear_block_gain(fit, one) for one in every]
    base["gain"] = leading_draws(fit, first, inflation, rng).tolist()
    unit = {**base_units(base, units), **effect_units(fit, units)}
    return JointPosterior(
        fit,
        drawn,
        {n: np.array(v) for n, v in base.items()},
        {n: np.array(v) for n, v in effects.items()},
        unit,
        tuple(sections),
    )


def nats_of(mean: FloatArray, drawn: FloatArray) -> float:
    """What quantities (n,) that scatter as `drawn` (draws, n) are worth over being zero: half of Wald's
    statistic, in nats."""
    variances, axes = np.linalg.eigh(np.atleast_2d(np.cov(drawn, rowvar=False)))
    least = float(mean @ mean) * np.finfo(float).eps ** 2
    return 0.5 * float(np.sum((axes.T @ mean) ** 2 / np.maximum(variances, least)))


def averaged(
    posterior: JointPosterior, rivals: Sequence[tuple[JointPosterior, float]], rng: np.random.Generator
) -> JointPosterior:
    """`posterior` with base parameters of explanations in its place, each in so many of the draws as its
    probability says; a mode that one of them lacks is there as in `posterior`."""
    base = {name: draws.copy() for name, draws in posterior.base.items()}
    share = rng.uniform(size=DRAWS)
    begin = 0.0
    for rival, probability in rivals:
        taken = (share >= begin) & (share < begin + probability)
        begin += probability
        for name, their_name in _named_alike(posterior.base, rival.base).items():
            base[name][taken] = rival.base[their_name][taken]
    return replace(posterior, base=base)


def _named_alike(own: Mapping[str, FloatArray], theirs: Mapping[str, FloatArray]) -> dict[str, str]:
    """Names of `own` base parameters with those of the same thing among `theirs`: modes are numbered by
    frequency in each, and are the same where their frequencies are."""
    found = {name: name for name in own if name in theirs and not name.startswith("mode")}
    frequency = ".frequency_hz"
    modes = {name: float(np.median(draws)) for name, draws in theirs.items() if name.endswith(frequency)}
    for name in (name for name in own if name.endswith(frequency)):
        here = float(np.median(own[name]))
        nearest = min(modes, key=lambda other: abs(np.log(modes[other] / here)), default=None)
        if nearest is not None and abs(np.log(modes[nearest] / here)) < SAME_MODE:
            mine, yours = name.removesuffix(frequency), nearest.removesuffix(frequency)
            found |= {n: yours + n.removeprefix(mine) for n in own if n.startswith(f"{mine}.")}
    return found


def _allowed(
    fit: JointFit, values: FloatArray, vectors: FloatArray, scale: FloatArray, inflation: float,
    rng: np.random.Generator,
) -> FloatArray:  # fmt: skip
    """Draws (draws, size) about the fit that the records allow.

    `values` and `vectors` are of the correlation matrix of whitened derivatives of columns of norms `scale`.
    Along a direction that the records hardly see, the likelihood is normal near the fit only: a step costs
    many times what it should. Such a draw is taken again with the variance along such directions capped, and
    nearer where that does not help.
    Poles are of the fit's kinds: a pair that parts into two real poles is of another structure, of which
    nothing about this fit tells, and a pole that the records do not see goes there half of the time.
    """
    size, centre = len(scale), fit.point.coordinates
    least = fit.point.log_likelihood - 0.5 * inflation**2 * (size + 4 * np.sqrt(2 * size))
    found = np.empty((DRAWS, size))
    begin, kinds = 0, _are_pairs(fit, centre)
    for number in range(DRAWS):
        at = max(begin - 1, 0)
        normal = inflation * rng.standard_normal(size)
        while True:
            root = vectors / np.sqrt(np.maximum(values, RIDGES[at]))
            for _ in range(TRIES):
                found[number] = fit.response.admissible(centre + root @ normal / scale, centre)
                if np.array_equal(_are_pairs(fit, found[number]), kinds):
                    break
                normal = inflation * rng.standard_normal(size)
            residuals = residuals_at(fit.response, found[number], fit.point.whitener)
            trial = replace(fit.point, residuals=residuals)
            finite = all(np.isfinite(e).all() for e in trial.known)
            reached = fit.point.whitener.log_likelihood(residuals, fit.point.masks) if finite else -np.inf
            if reached >= least:
                break
            if at < len(RIDGES) - 1:
                at += 1
            else:
                normal = normal / 2
        begin = at
    return found


def _whole_normal(
    fit: JointFit, sections: Sequence[int], values: FloatArray, vectors: FloatArray, scale: FloatArray,
    inflation: float, rng: np.random.Generator,
) -> list[JointValues]:  # fmt: skip
    """Draws for the limits, the dead zone and the dominant modes, the pairs of `sections`.

    Those are coordinates, or of two of them, and what `_allowed` takes off a step says nothing of them: that
    poles cancel, along which the likelihood is not normal, or that a law which sticks or turns over makes
    every step cost more than it should, so that draws shrink onto the fit.
    """
    centre, reported = fit.point.coordinates, list(sections)
    root = vectors / np.sqrt(np.maximum(values, UNSEEN)) / scale[:, None]
    kinds = _are_pairs(fit, centre)[reported]
    found = []
    for _ in range(DRAWS):
        for _ in range(TRIES):
            step = root @ (inflation * rng.standard_normal(len(scale)))
            at = fit.response.admissible(centre + step, centre)
            if np.array_equal(_are_pairs(fit, at)[reported], kinds):
                break
        found.append(fit.response.values(at))
    return found


def _are_pairs(fit: JointFit, coordinates: FloatArray) -> BoolArray:
    """Which sections (sections,) have complex poles."""
    a1, a2 = fit.response.values(coordinates).cascade.sections[:2]
    return np.asarray(a1 * a1 / 4 < a2, dtype=np.bool_)
