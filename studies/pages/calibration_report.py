"""The report of a calibration: are the intervals right, and would the check have noticed if they were not?"""

from __future__ import annotations

import numpy as np
from calibration_summary import INTERVALS, SIGNIFICANCE, CalibrationStudy, CalibrationSummary
from prior_calibration import LOG_LIKELIHOOD
from rank_statistics import IntervalCoverage, ecdf_counts, histogram_counts

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import (
    Badge,
    Block,
    Bullets,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
)
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_duration, format_interval, format_p_value, format_percent
from bayes_hw.report.page.typography import typeset
from pages.figures_calibration import (
    IntervalPoint,
    RankPanel,
    ecdf_differences,
    interval_coverage,
    rank_histograms,
)

HDI_COLUMN = len(INTERVALS) - 1


def calibration_report(study: CalibrationStudy, provenance: Provenance) -> Report:
    """The report whose first page answers: are the intervals right?"""
    return Report(
        title="Calibration of the inference",
        subtitle="Simulation-based calibration of the whole pipeline, from the priors to the ranks",
        verdict=_verdict(study),
        badges=_badges(study),
        key_figure=ecdf_differences(rank_panels(study.right), f"{study.right.replicates} replicates"),
        sections=(
            _method_section(study),
            _right_section(study.right),
            _wrong_section(study),
            _order_section(study),
            _limits_section(study),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def rank_panels(summary: CalibrationSummary) -> list[RankPanel]:
    """The ranks of every quantity with their bands, for the figures."""
    ecdf, histogram, count = summary.ecdf_bands, summary.histogram_bands, summary.replicates
    return [
        RankPanel(
            label=_words(name),
            counts=histogram_counts(ranks, summary.draws, len(histogram.probability)).astype(np.float64),
            lower=histogram.lower,
            upper=histogram.upper,
            probability=ecdf.probability,
            difference=ecdf_counts(ranks, summary.draws, len(ecdf.probability) + 1) / count
            - ecdf.probability,
            difference_lower=ecdf.lower / count - ecdf.probability,
            difference_upper=ecdf.upper / count - ecdf.probability,
        )
        for name, ranks in summary.ranks.items()
    ]


def _verdict(study: CalibrationStudy) -> str:
    right = study.right
    held = right.axis_coverage()[HDI_COLUMN]
    axes = f"over {right.replicates} axes drawn from the priors"
    finding = (
        f"The posterior is calibrated: {axes}, the ranks of all {len(right.ranks)} quantities are as uniform"
        " as they should be"
        if right.calibrated
        else f"The posterior is NOT calibrated: {axes}, the ranks of {_words(right.worst)} are not uniform"
    )
    coverage = (
        f" ({_p_text(right.p_value)} for all together), and {INTERVALS[HDI_COLUMN]} intervals of the axis's"
        f" parameters hold the truth in {format_percent(held, 1)} of the cases."
    )
    missed = [name for name, summary in study.wrong.items() if summary.calibrated]
    power = (
        f" NOT found out by the same check: {', '.join(missed)}."
        if missed
        else " The same check finds every likelihood that was made wrong on purpose"
        f" ({', '.join(study.wrong)})."
    )
    return finding + coverage + power


def _badges(study: CalibrationStudy) -> tuple[Badge, ...]:
    right = study.right
    hdi = [entries[HDI_COLUMN] for entries in right.coverage.values()]
    lowest, highest = min(c.achieved for c in hdi), max(c.achieved for c in hdi)
    intervals = sum(len(entries) for entries in right.coverage.values())
    covers = right.coverage_p_value >= SIGNIFICANCE
    return (
        Badge(
            "ranks uniform" if right.calibrated else "ranks not uniform",
            "good" if right.calibrated else "bad",
            f"{_p_text(right.p_value)}, least uniform: {_words(right.worst)}",
        ),
        Badge(
            "intervals cover" if covers else "intervals do not cover",
            "good" if covers else "bad",
            f"{INTERVALS[HDI_COLUMN]}: {format_percent(lowest, 1)} to {format_percent(highest, 1)};"
            f" {_p_text(right.coverage_p_value)} for all {intervals} coverages together",
        ),
        *(
            Badge(
                "missed" if summary.calibrated else "wrong likelihood found",
                "bad" if summary.calibrated else "good",
                f"{name}: {_p_text(summary.p_value)} with {summary.replicates} replicates",
            )
            for name, summary in study.wrong.items()
        ),
        Badge(
            "samplers converged" if right.not_converged == 0 else "some not converged",
            "good" if right.not_converged == 0 else "warn",
            f"{right.not_converged} of {right.replicates} said so; they are counted all the same",
        ),
    )


def _method_section(study: CalibrationStudy) -> Section:
    case, axis = study.case, study.case.axis
    parameters = (*axis.parameters, *case.noise())
    rate = case.model.sample_rate_hz
    rows = tuple((_words(p.name), typeset(p.prior.describe(p.unit))) for p in parameters)
    settings = case.settings
    return Section(
        "What was done",
        (
            Paragraph(
                "For every replicate, all parameters of an axis and of its noise are drawn from their "
                f"priors, a record of {len(case.command)} samples at {rate:g} Hz is simulated in the time "
                "domain (not with the compiled kernel that the likelihood uses), and the posterior is "
                "started and sampled as that of a measured record: least squares from several starts, "
                f"pilot, refitted proposals, {settings.ensembles} ensembles of {settings.walkers} walkers. "
                f"The rank of every true value among {study.right.draws} independent draws, taken an "
                "autocorrelation time apart, is uniform if priors, simulator, likelihood, moves and sampler "
                "belong together (Talts et al., arXiv 1804.06788). The log-likelihood is ranked as well, "
                "since a posterior that ignored the data would pass on the parameters alone (Modrák et al., "
                "doi 10.1214/23-BA1404)."
            ),
            Table(
                ("parameter", "prior, in the draws and in the posterior"),
                rows,
                f"Priors: those of the program with {case.prior_width:g} times the standard deviation of its "
                "log-normal ones. The noise's priors, which the program centres on an estimate, are fixed "
                "beforehand: priors that look at the data have no calibration.",
            ),
            Paragraph(
                "A quantity fails when its ECDF leaves the simultaneous 95 % band (Säilynoja, Bürkner and "
                "Vehtari, doi 10.1007/s11222-022-10090-6); the verdict on all quantities together takes the "
                "smallest p-value times their number (Bonferroni) against 5 %. With so many panels one may "
                "leave its band by chance. A replicate took "
                f"{format_duration(study.right.seconds)} on average."
            ),
        ),
    )


def _right_section(right: CalibrationSummary) -> Section:
    rows = tuple(
        (
            _words(name),
            format_p_value(right.p_values[name]),
            *(f"{100 * c.achieved:.1f} {_in_percent(c)}" for c in right.coverage.get(name, ())),
            *([""] * (len(INTERVALS) if name not in right.coverage else 0)),
        )
        for name in right.ranks
    )
    return Section(
        "Ranks and coverage with the right likelihood",
        (
            rank_histograms(rank_panels(right), f"{right.replicates} replicates"),
            interval_coverage(_interval_points(right)),
            Table(
                ("quantity", "p", *INTERVALS),
                rows,
                "p-value of the ECDF of each quantity alone, and coverage of its intervals with 95 % "
                "binomial intervals, in per cent.",
                (1, *range(2, 2 + len(INTERVALS))),
            ),
        ),
    )


def _wrong_section(study: CalibrationStudy) -> Section:
    blocks: list[Block] = [
        Paragraph(
            "A check that cannot fail proves nothing. The records come from the same priors; only the"
            " likelihood is wrong. Since sigma is sampled, a factor on it shifts its own posterior and the"
            " log-likelihood, and leaves the intervals of the axis as they are; ignored correlation changes"
            " those too."
        ),
        Table(
            ("likelihood", "replicates", "p of all", "least uniform", *INTERVALS),
            tuple(
                (
                    name,
                    str(summary.replicates),
                    _p_text(summary.p_value),
                    _words(summary.worst),
                    *(format_percent(share, 1) for share in summary.axis_coverage()),
                )
                for name, summary in {"right": study.right, **study.wrong}.items()
            ),
            "Likelihoods made wrong on purpose. The last columns are the coverage of the axis's parameters, "
            "pooled; those of the noise are left out.",
            (1, 2, *range(4, 4 + len(INTERVALS))),
        ),
    ]
    blocks += [ecdf_differences(rank_panels(summary), name) for name, summary in study.wrong.items()]
    return Section("Wrong likelihoods must fail", tuple(blocks))


def _order_section(study: CalibrationStudy) -> Section:
    true_order = len(study.order_noise)
    rows = tuple(
        (
            f"AR({order})" + (" (true)" if order == true_order else ""),
            str(summary.replicates),
            *(format_percent(share, 1) for share in summary.axis_coverage()),
            f"{summary.not_white} of {summary.replicates}",
        )
        for order, summary in study.orders.items()
    )
    noise = ", ".join(f"{kappa:g}" for kappa in study.order_noise)
    return Section(
        "An AR order that is too low",
        (
            Paragraph(
                f"Noise of order {true_order} with partial autocorrelations {noise}, sampled with this order"
                " and with lower ones. A likelihood of too low an order counts correlated samples as if each"
                " brought new information: its intervals must be too narrow, and the Ljung-Box test of the"
                " whitened residuals should say so."
            ),
            Table(
                ("assumed noise", "replicates", *INTERVALS, "residuals not white"),
                rows,
                "Coverage of the intervals of the axis's parameters, pooled, and number of replicates whose "
                "Ljung-Box test (1 %) finds correlation left in time.",
                (1, *range(2, 3 + len(INTERVALS))),
            ),
        ),
    )


def _limits_section(study: CalibrationStudy) -> Section:
    right = study.right
    return Section(
        "What this does not show",
        (
            Bullets(
                (
                    "It is an average over the priors of one kind of axis and one command; a rare failure "
                    "in a corner of the parameter space, or a fault smaller than the bands, can hide in it.",
                    f"The log-normal priors are {study.case.prior_width:g} times as wide as the program's, "
                    "so that a replicate takes seconds; nearly unidentifiable axes, which wide priors "
                    "allow, are rarer.",
                    "It says nothing about records of an axis that the model does not describe.",
                    f"{right.not_converged} of {right.replicates} samplers ended without having converged "
                    "by their own tests; leaving them out would bias the ranks, so they are counted.",
                )
            ),
        ),
    )


def _interval_points(summary: CalibrationSummary) -> list[IntervalPoint]:
    return [
        IntervalPoint(_words(name), kind, c.nominal, c.achieved, *c.interval)
        for name, entries in summary.coverage.items()
        for kind, c in zip(INTERVALS, entries, strict=True)
    ]


def _in_percent(coverage: IntervalCoverage) -> str:
    low, high = coverage.interval
    return format_interval(100 * low, 100 * high)


def _words(name: str) -> str:
    return "log-likelihood" if name == LOG_LIKELIHOOD else parameter_name(name).words


def _p_text(p_value: float) -> str:
    return f"p = {p_value:.2g}" if p_value >= 0.01 else f"p = {p_value:.1g}"
