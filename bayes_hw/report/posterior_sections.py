"""Sections on the posterior: parameters, correlations, convergence, and what freeing all of G costs."""

from __future__ import annotations

import numpy as np

from bayes_hw.analysis import Analysis
from bayes_hw.arrays import FloatArray
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import Summary
from bayes_hw.model.priors import Prior
from bayes_hw.report.document import Bullets, Callout, Figure, Paragraph, Section, Table
from bayes_hw.report.figures_posterior import (
    CORNER_LIMIT,
    IntervalSet,
    Marginal,
    autocorrelation,
    corner_plot,
    interval_comparison,
    priors_and_posteriors,
    traces,
)
from bayes_hw.report.names import parameter_name
from bayes_hw.report.rounding import format_estimate, format_interval, format_number, format_value

CORNER_DRAWS = 20_000
MARGINAL_DRAWS = 40_000


def posterior_sections(analysis: Analysis) -> tuple[Section, ...]:
    """Parameters, correlations, convergence, and the comparison with all of G free."""
    posterior = analysis.dominant.posterior
    summaries = posterior.summaries
    sections = [
        _parameter_section(analysis, summaries),
        Section("Correlations", (_corner(posterior, summaries),)),
        _convergence_section(analysis, summaries),
    ]
    if analysis.everything is not None:
        sections.append(_widening_section(summaries, analysis.everything.posterior))
    return tuple(sections)


def _flat(posterior: Posterior, count: int) -> FloatArray:
    flat = posterior.values.reshape(-1, posterior.values.shape[-1])
    return flat[:: -(-len(flat) // count)]


def _prior_density(prior: Prior):  # type: ignore[no-untyped-def]
    return lambda values: np.exp(prior.log_density(values))


def _parameter_section(analysis: Analysis, summaries: dict[str, Summary]) -> Section:
    posterior = analysis.dominant.posterior
    draws = _flat(posterior, MARGINAL_DRAWS)
    marginals = [
        Marginal(
            parameter_name(parameter.name),
            parameter.unit,
            draws[:, i],
            _prior_density(parameter.prior),
            summaries[parameter.name].hdi94,
            float(posterior.point_estimate[i]),
            analysis.truth.get(parameter.name),
        )
        for i, parameter in enumerate(posterior.parameters)
    ]
    priors = {parameter.name: parameter.prior.describe(parameter.unit) for parameter in posterior.parameters}
    rows = tuple(
        (
            parameter_name(name).words,
            priors[name],
            format_estimate(summary.mean, summary.sd, summary.unit),
            format_interval(*summary.hdi94, summary.unit),
        )
        for name, summary in summaries.items()
    )
    derived = tuple(
        (
            parameter_name(name).words,
            "follows from the others",
            format_estimate(summary.mean, summary.sd, summary.unit),
            format_interval(*summary.hdi94, summary.unit),
        )
        for name, summary in posterior.derived.items()
    )
    return Section(
        "Parameters",
        (
            Table(
                ("parameter", "prior", "posterior mean ± sd", "94 % HDI"),
                (*rows, *derived),
                "Posterior of every sampled parameter and of what follows from them. HDI: highest-density "
                "interval. The priors are weakly informative: centred on the model that sampling started "
                "from, and much wider than the posterior where the records inform.",
                (2, 3),
            ),
            priors_and_posteriors(marginals),
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
    posterior, sampling = analysis.dominant.posterior, analysis.dominant.sampling
    ensembles, steps, walkers, _ = posterior.values.shape
    names = [parameter_name(name) for name in posterior.names]
    table = Table(
        ("parameter", "mean", "MCSE of the mean", "bulk ESS", "tail ESS", "nested R-hat"),
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
    blocks: list[Paragraph | Callout | Bullets | Table | Figure] = [
        Paragraph(
            f"{ensembles} ensembles of {walkers} walkers ran {steps} steps each after the pilot, from starts "
            f"spread over twice the width of the posterior. {sampling.plan.independence_weight:.0%} of "
            f"the moves were independence proposals from a t mixture refitted to the pilot, the rest differential "
            f"evolution; {np.mean(sampling.acceptance):.0%} of all proposals were accepted. "
            f"{sampling.non_finite} evaluations gave no finite number. {agreeing}"
        )
    ]
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
    return Section("Convergence", tuple(blocks))


def sampling_starts(analysis: Analysis) -> str:
    """Whether the descents that preceded sampling agreed."""
    starts = analysis.dominant.start.starts
    total = len(starts.sums_of_squares)
    return f"Before sampling, {starts.agreeing} of {total} least-squares descents reached the same minimum."


def _widening_section(dominant: dict[str, Summary], everything: Posterior) -> Section:
    all_summaries = everything.summaries
    shared = [name for name in dominant if name in all_summaries]
    sets = [
        IntervalSet(
            label,
            np.array([summaries[name].mean for name in shared]),
            np.array([summaries[name].hdi94[0] for name in shared]),
            np.array([summaries[name].hdi94[1] for name in shared]),
        )
        for label, summaries in (("dominant parameters free", dominant), ("all of G free", all_summaries))
    ]
    table = Table(
        ("parameter", "94 % HDI, dominant free", "94 % HDI, all of G free", "wider by"),
        tuple(
            (
                parameter_name(name).words,
                format_interval(*dominant[name].hdi94, dominant[name].unit),
                format_interval(*all_summaries[name].hdi94, all_summaries[name].unit),
                f"{_width(all_summaries[name]) / _width(dominant[name]):.2f}",
            )
            for name in shared
        ),
        "What it costs to hold the other roots of G: the intervals with every pole and zero free, and the "
        "ratio of the widths.",
        (1, 2, 3),
    )
    blocks: list[Paragraph | Callout | Table | Figure] = []
    if not everything.converged:
        blocks.append(Callout("warn", "All of G free: not converged", "; ".join(everything.problems)))
    blocks += [
        table,
        interval_comparison(
            sets,
            [parameter_name(name) for name in shared],
            np.array([dominant[name].sd for name in shared]),
        ),
    ]
    return Section("All of G free", tuple(blocks))


def widest_ratio(dominant: dict[str, Summary], everything: dict[str, Summary]) -> float:
    """The largest factor by which an interval widens when all of G is free."""
    return max(_width(everything[name]) / _width(dominant[name]) for name in dominant if name in everything)


def _width(summary: Summary) -> float:
    return summary.hdi94[1] - summary.hdi94[0]
