"""Sections on the posterior: parameters, correlations, convergence, and what freeing all of G costs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.analysis import Analysis
from bayes_hw.arrays import FloatArray
from bayes_hw.identify.structure_pool import StructurePool
from bayes_hw.infer.own_check import OwnCheck
from bayes_hw.infer.posterior import PRIOR_DOMINATED_BELOW, Posterior
from bayes_hw.infer.reweighting import Reweighting
from bayes_hw.infer.summary import Summary
from bayes_hw.model.priors import Prior
from bayes_hw.report.axis.axis_sight import trade_blocks
from bayes_hw.report.page.document import Bullets, Callout, Figure, Paragraph, Section, Table
from bayes_hw.report.page.names import LEGEND, parameter_name, prior_notation
from bayes_hw.report.page.rounding import (
    format_estimate,
    format_interval,
    format_number,
    format_percent,
    format_value,
)
from bayes_hw.report.page.typography import typeset
from bayes_hw.report.posterior.figures_posterior import (
    CORNER_LIMIT,
    Marginal,
    autocorrelation,
    corner_plot,
    priors_and_posteriors,
    traces,
)

CORNER_DRAWS = 20_000
MARGINAL_DRAWS = 40_000
AXIS_NUMBERS = (
    "saturation.lower",
    "saturation.upper",
    "dead_zone.half_width",
    "gain",
    "velocity_gain",
    "noise.sigma",
)
PARAMETER_HEADER = ("parameter", "prior", "posterior mean ± sd", "94 % HDI")


def posterior_sections(analysis: Analysis) -> tuple[Section, ...]:
    """Correlations and convergence, for who doubts the sampling."""
    posterior = analysis.inference.posterior
    summaries = posterior.summaries
    return (
        *(() if analysis.check is None else (_check_section(analysis.check),)),
        Section(
            "Correlations",
            (_corner(posterior, summaries), *(trade_blocks(posterior.trade) if posterior.trade else ())),
            folded=True,
        ),
        _convergence_section(analysis, summaries),
    )


def _flat(posterior: Posterior, count: int) -> FloatArray:
    flat = posterior.values.reshape(-1, posterior.values.shape[-1])
    return flat[:: -(-len(flat) // count)]


def _prior_density(prior: Prior):  # type: ignore[no-untyped-def]
    return lambda values: np.exp(prior.log_density(values))


def numbers_section(analysis: Analysis) -> Section:
    """The numbers of the axis; of a model that its residuals refute they are folded and marked."""
    posterior, residuals = analysis.inference.posterior, analysis.inference.residuals
    holds = residuals.white and residuals.explained
    weak = posterior.prior_dominated
    rows = tuple(
        (
            parameter_name(name).words + (" †" if name in weak else ""),
            format_estimate(s.mean, s.sd, s.unit),
            format_interval(*s.hdi94, s.unit),
        )
        for name, s in {**posterior.reported, **posterior.derived}.items()
        if name in AXIS_NUMBERS or (name.startswith("mode") and name.endswith(("_hz", "_ratio")))
    )
    blocks: list[Callout | Paragraph | Table] = []
    if not holds:
        text = "; ".join(residuals.failures) or "it explains little of the records"
        blocks.append(Callout("bad", "Of a model that does not hold", f"{text}. Rely on none of these."))
    if posterior.conditional_on:
        blocks.append(Callout("warn", "Conditional intervals", conditional_sentence(posterior)))
    blocks.append(
        Table(
            ("parameter", "mean ± sd", "94 % interval"),
            rows,
            "The axis in numbers (94 %: highest-density interval). What else was sampled is folded below."
            + _mark(posterior),
            (1, 2),
        )
    )
    if analysis.identification is not None:
        blocks.append(Paragraph(typeset(structure_sentences(analysis.identification.pool))))
    title = "How sure are the numbers?" if holds else "Numbers of a model that does not hold"
    return Section(title, tuple(blocks), folded=not holds)


def parameter_section(analysis: Analysis) -> Section:
    """Every sampled parameter with its prior."""
    posterior = analysis.inference.posterior
    derived = tuple(
        (
            parameter_name(name).words,
            "follows from the others",
            format_estimate(summary.mean, summary.sd, summary.unit),
            format_interval(*summary.hdi94, summary.unit),
        )
        for name, summary in posterior.derived.items()
        if not name.startswith("noise.autoregression")
    )
    blocks: list[Table | Figure] = [
        Table(
            PARAMETER_HEADER,
            (*_parameter_rows(posterior), *derived),
            "Posterior of every sampled parameter and of what follows from them. HDI: highest-density "
            f"interval. {LEGEND} They are centred on the model that sampling started from.{_mark(posterior)}",
            (2, 3),
        ),
        priors_and_posteriors(marginals(posterior, posterior.names, analysis.truth)),
    ]
    return Section("Every sampled parameter, with its prior", tuple(blocks), folded=True)


def structure_sentences(pool: StructurePool) -> str:
    """Which structure was taken, and what the intervals rest on."""
    return " ".join(said[:1].upper() + said[1:] + "." for said in (pool.sentence, pool.basis))


def conditional_sentence(posterior: Posterior) -> str:
    """What the intervals take as known, and what follows."""
    known = " and ".join(posterior.conditional_on)
    return (
        f"These intervals take {known} as known. Where the same records gave them, the intervals are too "
        "narrow, often by half."
    )


def _parameter_rows(posterior: Posterior) -> tuple[tuple[str, ...], ...]:
    weak = posterior.prior_dominated
    return tuple(
        (
            parameter_name(parameter.name).words + (" †" if parameter.name in weak else ""),
            prior_notation(parameter.prior),
            format_estimate(summary.mean, summary.sd, summary.unit),
            format_interval(*summary.hdi94, summary.unit),
        )
        for parameter, summary in zip(posterior.parameters, posterior.summaries.values(), strict=True)
    )


def _mark(posterior: Posterior) -> str:
    """What the dagger of a table means, where there is one."""
    if not posterior.prior_dominated:
        return ""
    return (
        " † prior-dominated: the contraction, one less the ratio of posterior to prior variance, is below "
        f"{PRIOR_DOMINATED_BELOW:g}; the records say little about it."
    )


def marginals(posterior: Posterior, names: Sequence[str], truth: dict[str, float]) -> list[Marginal]:
    """Draws, prior and interval of the parameters named, with their true values where they are known."""
    draws = _flat(posterior, MARGINAL_DRAWS)
    found = []
    for name in names:
        i = posterior.names.index(name)
        parameter = posterior.parameters[i]
        found.append(
            Marginal(
                parameter_name(name),
                parameter.unit,
                draws[:, i],
                _prior_density(parameter.prior),
                posterior.summaries[name].hdi94,
                float(posterior.point_estimate[i]),
                truth.get(name),
            )
        )
    return found


def _check_section(check: OwnCheck) -> Section:
    """How often the intervals of axes simulated from this posterior held."""
    rows = []
    for name, one in check.held.items():
        low, high = one.interval95
        rows.append(
            (
                parameter_name(name).words,
                f"{one.held} of {one.of}",
                f"{format_percent(low)} to {format_percent(high)}",
                "too seldom" if name in check.refuted else "",
            )
        )
    return Section(
        "Do the intervals hold?",
        (
            Paragraph(
                f"{check.replicates} axes were drawn from this posterior and simulated under the commands "
                "of these records, each with its own noise; each was then identified and sampled anew from "
                f"its records alone, and {check.converged} of the samplings converged. An interval of 94 % "
                "should hold the value that was simulated with in 94 % of them. A resonance that was not "
                "found again counts as not held."
            ),
            Table(
                ("parameter", "held", "95 % interval of the share", ""),
                tuple(rows),
                "How often the 94 % intervals held (intervals of the share: Clopper and Pearson).",
                (1, 2),
            ),
        ),
    )


def _corner(posterior: Posterior, summaries: dict[str, Summary]) -> Figure:
    chosen = list(range(min(CORNER_LIMIT, len(posterior.names))))
    return corner_plot(
        _flat(posterior, CORNER_DRAWS)[:, chosen],
        [parameter_name(posterior.names[i]) for i in chosen],
        [posterior.parameters[i].unit for i in chosen],
        np.array([summaries[posterior.names[i]].hdi94 for i in chosen]),
        posterior.point_estimate[chosen],
    )


def _convergence_section(analysis: Analysis, summaries: dict[str, Summary]) -> Section:
    posterior, sampling = analysis.inference.posterior, analysis.inference.sampling
    ensembles, steps, walkers, _ = posterior.values.shape
    names = [parameter_name(name) for name in posterior.names]
    table = Table(
        ("parameter", "mean", "MCSE of the mean", "bulk ESS", "tail ESS", "nested R‑hat"),
        tuple(
            (
                parameter_name(name).words,
                format_value(summary.mean, summary.mcse_mean, summary.unit),
                format_number(summary.mcse_mean, 2, summary.unit),
                f"{summary.ess_bulk:.0f}",
                f"{summary.ess_tail:.0f}",
                f"{summary.r_hat:.4f}",
            )
            for name, summary in summaries.items()
        ),
        "Sampling diagnostics. ESS: effective sample size from the autocorrelation time; MCSE: Monte Carlo "
        "standard error. Converged means nested R-hat below 1.01 and at least 400 effective samples.",
        (1, 2, 3, 4, 5),
    )
    agreeing = sampling_starts(analysis)
    independent = format_percent(sampling.plan.independence_weight)
    accepted = format_percent(float(np.mean(sampling.acceptance)))
    ran = f"{ensembles} ensembles of {walkers} walkers ran {steps} steps each"
    if posterior.reweighting is not None:
        ran = f"{ensembles} ensembles ran"
    blocks: list[Paragraph | Callout | Bullets | Table | Figure] = [
        Paragraph(
            f"{ran} after the pilot, from "
            f"starts spread over twice the width of the posterior. {independent} "
            "of the moves were proposals from a t mixture fitted by the pilot, most of them on the side "
            "opposite to the walker (overrelaxation) and the others independent of it, the rest "
            f"differential evolution; {accepted} of all proposals were accepted. "
            f"{sampling.non_finite} evaluations gave no finite number. {agreeing}"
        )
    ]
    if posterior.reweighting is not None:
        blocks.append(Paragraph(stand_in_sentence(posterior.reweighting)))
    if not posterior.converged:
        blocks += [
            Callout("bad", "Not converged", "Do not rely on the intervals of this report."),
            Bullets(posterior.problems),
        ]
    times = (
        posterior.convergence.autocorrelation_time
        if posterior.convergence is not None
        else np.full(len(names), np.nan)
    )
    blocks += [
        table,
        traces(posterior.values, names, [parameter.unit for parameter in posterior.parameters]),
        autocorrelation(analysis.autocorrelations, times, names),
    ]
    return Section("Convergence", tuple(blocks), folded=posterior.converged)


def stand_in_sentence(judged: Reweighting) -> str:
    """What the sampler walked on instead of the exact posterior, and how good that was."""
    walked = {
        "expanded_likelihood": f"The records are long ({judged.samples} samples): the chains walked on a "
        "likelihood whose residuals are expanded to second order about the estimate, from all samples",
        "following_weights": "The chains walked in limits, dead zone, gain, poles and noise; the weights of "
        "the poles followed along the line on which the normal approximation has them, and were drawn about "
        "it",
    }
    return (
        f"{walked[judged.of]}. Of these draws {judged.draws} were weighed by the exact posterior and "
        "drawn again by their weights, which are worth "
        f"{format_number(judged.effective, 4)} draws; Pareto's k of their tail is "
        f"{format_number(judged.pareto_k, 2)} (0.7 is the most that may be relied on)."
    )


def sampling_starts(analysis: Analysis) -> str:
    """Whether the descents that preceded sampling agreed."""
    starts = analysis.inference.start.starts
    total = len(starts.sums_of_squares)
    return f"Before sampling, {starts.agreeing} of {total} least-squares descents reached the same minimum."
