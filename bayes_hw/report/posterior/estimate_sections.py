"""Sections on the point estimate: the four steps and the residual tests."""

from __future__ import annotations

import numpy as np

from bayes_hw.analysis import Analysis
from bayes_hw.first_look.frequency_response import FrequencyResponse
from bayes_hw.first_look.frequency_response import frequency_response as frequency_response_of
from bayes_hw.identify.result import Identification
from bayes_hw.identify.structure_pool import StructurePool
from bayes_hw.report.page.document import Bullets, Figure, Paragraph, Section, Table
from bayes_hw.report.page.rounding import format_number, format_p_value, format_percent
from bayes_hw.report.page.typography import MINUS, typeset
from bayes_hw.report.posterior.figures_identification import (
    ResidualDiagnostics,
    ResponseBand,
    StaticBlock,
    frequency_response,
    residual_diagnostics,
    static_blocks,
    step_results,
)

LISTED_ORDERS = 12


def estimate_sections(analysis: Analysis) -> tuple[Section, ...]:
    """The four steps, where there was an identification."""
    return () if analysis.identification is None else (_steps_section(analysis, analysis.identification),)


def _steps_section(analysis: Analysis, identification: Identification) -> Section:
    units = analysis.records[0].units
    steps = identification.steps
    model = identification.model
    curve, cloud = identification.input_curve, identification.output_cloud
    u = np.linspace(curve.abscissa.min(), curve.abscissa.max(), 200)
    has_dead_zone = identification.blocks_shown["dead_zone"].shown
    w = np.linspace(cloud.abscissa.min(), cloud.abscissa.max(), 400 if has_dead_zone else 0)
    blocks = static_blocks(
        (
            StaticBlock(
                "input: rebuilt v and fitted saturation",
                curve.abscissa,
                curve.ordinate,
                u,
                model.saturation(u),
                f"command u ({units.input})",
                f"v ({units.input})",
            ),
            StaticBlock(
                "output: rebuilt w" + (" and fitted dead zone" if has_dead_zone else ", no dead zone shown"),
                cloud.abscissa,
                cloud.ordinate,
                w,
                model.dead_zone(w),
                f"w ({units.output})",
                f"y ({units.output})",
            ),
        )
    )
    return Section(
        "Point estimate in four steps",
        (
            Bullets(tuple(f"{step.name}: {step.description}" for step in steps)),
            step_results(
                [step.name for step in steps],
                np.array([step.cost for step in steps]),
                np.array([step.fit_percent for step in steps]),
                units.output,
                steps[0].fit_percent,
            ),
            blocks,
            _shown_table(identification),
            _order_table(identification),
            _pool_table(identification.pool),
            *_warnings(identification),
        ),
        folded=True,
    )


def response_figure(analysis: Analysis, measured: FrequencyResponse | None) -> Figure:
    """G over frequency, and the response measured without any model."""
    response, reported = analysis.response, analysis.inference.posterior.reported
    modes = [s.mean for n, s in reported.items() if n.startswith("mode") and n.endswith("frequency_hz")]
    units = analysis.records[0].units
    return frequency_response(
        response.frequency_hz,
        response.model,
        f"{units.output} per {units.input}",
        response.baseline,
        ResponseBand("94 % of the draws", *response.magnitude_db, *response.phase_deg),
        measured=measured,
        modes_hz=modes,
    )


def measured_response(analysis: Analysis) -> FrequencyResponse | None:
    """Of the output to the command behind the model's limits, by the local polynomial method."""
    model = analysis.inference.posterior.mean_model()
    return frequency_response_of(
        [record.y for record in analysis.records],
        [model.saturation(record.u) for record in analysis.records],
        model.sample_rate_hz,
    )


def _shown_table(identification: Identification) -> Table:
    return Table(
        ("block", "shown by the records", "reason"),
        tuple(
            (key, "yes" if shown.shown else "no", typeset(shown.reason))
            for key, shown in identification.blocks_shown.items()
        ),
        "Which blocks the records show. A block that they do not show is not estimated: a limit stands at "
        "the largest command seen, a dead zone at zero width.",
    )


def _warnings(identification: Identification) -> tuple[Bullets, ...]:
    """What a reader of the estimate must see, but for the blocks of the table above."""
    hidden = {shown.reason for shown in identification.blocks_shown.values()}
    kept = tuple(typeset(text) for text in identification.warnings if text.split(": ", 1)[-1] not in hidden)
    return (Bullets(kept),) if kept else ()


def _order_table(identification: Identification) -> Table:
    best = sorted(identification.orders, key=lambda candidate: candidate.criterion)[:LISTED_ORDERS]
    smallest = best[0].criterion
    return Table(
        ("order", "delay (samples)", "integrator", "rms output error", "criterion above the best"),
        tuple(
            dict.fromkeys(
                (
                    str(candidate.order),
                    str(candidate.delay_samples),
                    "yes" if candidate.integrator else "no",
                    format_number(candidate.rms, 4),
                    f"{candidate.criterion - smallest:.1f}",
                )
                for candidate in best
            )
        ),
        "The structures tried for the whole cascade, best first.",
        (0, 1, 3, 4),
    )


def _pool_table(pool: StructurePool) -> Table:
    return Table(
        ("order", "delay (samples)", "poles kept, slow + fast", "log-likelihood", "parameters", "weight", ""),
        tuple(
            (
                str(member.order),
                str(member.delay_samples),
                f"{member.slow_poles_added} + {member.onset_poles_added}",
                f"{member.log_likelihood - pool.chosen.log_likelihood:+.1f}".replace("-", MINUS),
                str(member.parameters),
                format_percent(member.weight),
                "taken" if member.chosen else "",
            )
            for member in pool.members
        ),
        "The pool of structures: log-likelihood against that of the one taken, and weights "
        "exp(log-likelihood − parameters) over all that were visited.",
        (0, 1, 2, 3, 4, 5),
    )


def residual_section(analysis: Analysis) -> Section:
    residuals, spectrum = analysis.inference.residuals, analysis.spectrum
    rate = analysis.records[0].sample_rate_hz
    joined = np.concatenate(residuals.innovations)
    order = analysis.inference.posterior.noise_order
    figure = residual_diagnostics(
        ResidualDiagnostics(
            t=np.arange(len(joined)) / rate,
            residual=joined,
            unit=analysis.records[0].units.output,
            autocorrelation=residuals.autocorrelation,
            bound=residuals.bound,
            frequency_hz=spectrum.frequency_hz,
            density=spectrum.density,
            white_density=spectrum.white_density,
            normal_quantiles=spectrum.normal_quantiles,
            ordered=spectrum.ordered,
        ),
        "innovations",
    )
    table = Table(
        ("test", "statistic", "p‑value", "passed", "meaning"),
        tuple(
            (
                test.name,
                format_number(test.statistic),
                format_p_value(test.p_value),
                "yes" if test.passed else "no",
                test.meaning,
            )
            for test in residuals.tests
        ),
        "Tests of the innovations, each at 1 %.",
        (1, 2),
    )
    return Section(
        "What is left",
        (
            Paragraph(
                f"The noise model is an autoregression of order {order}, chosen by the Bayesian information "
                "criterion. What it leaves, the innovations, should be white, independent of the command and "
                "normal. Records are joined end to end in the figure."
            ),
            table,
            figure,
        ),
        folded=residuals.white and residuals.explained,
    )
