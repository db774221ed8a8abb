"""The report on one axis: from an analysis to a document."""

from __future__ import annotations

import numpy as np

from bayes_hw.analysis import Analysis
from bayes_hw.infer.prediction import Coverage, Prediction
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.provenance import Provenance
from bayes_hw.report.axis.axis_sight import STEP_DRAWS, errors_of_residuals, rise_remark, step_of_models
from bayes_hw.report.axis.figures_axis import command_and_angle, errors_figure, step_figure
from bayes_hw.report.page import equations
from bayes_hw.report.page.document import (
    Bullets,
    Callout,
    Equation,
    Figure,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
    ZoomableRecord,
)
from bayes_hw.report.page.rounding import format_duration, format_interval, format_percent
from bayes_hw.report.posterior.estimate_sections import (
    estimate_sections,
    measured_response,
    residual_section,
    response_figure,
)
from bayes_hw.report.posterior.figures_prediction import Coverage as CoverageRow
from bayes_hw.report.posterior.figures_prediction import PredictedRecord, predicted_overview, predicted_record
from bayes_hw.report.posterior.figures_prediction import coverage as coverage_figure
from bayes_hw.report.posterior.posterior_sections import (
    numbers_section,
    parameter_section,
    posterior_sections,
)
from bayes_hw.report.posterior.verdict import LIMITS, badges, verdict

ZOOM_SHARE = 0.1


def posterior_report(analysis: Analysis, provenance: Provenance) -> Report:
    """The report whose first page answers: how good is the model, how sure are its numbers."""
    return Report(
        title=analysis.title,
        subtitle="Hammerstein-Wiener model of a servo axis with posterior uncertainty",
        verdict=verdict(analysis),
        badges=badges(analysis),
        key_figure=_overview(analysis, analysis.predictions[0]),
        sections=(
            _prediction_section(analysis),
            _axis_section(analysis),
            numbers_section(analysis),
            residual_section(analysis),
            _data_section(analysis),
            *estimate_sections(analysis),
            parameter_section(analysis),
            *posterior_sections(analysis),
            _model_section(),
            _limits_section(analysis),
            Section("Provenance", (KeyValues(provenance.rows()),), folded=True),
        ),
    )


def _axis_section(analysis: Analysis) -> Section:
    """Command and angle, the response with what was measured, and a remark where it rises unmeasured."""
    posterior = analysis.inference.posterior
    limits = [posterior.reported[name].mean for name in LIMITS]
    response = analysis.response
    measured = measured_response(analysis)
    speed = np.abs(response.model) * response.frequency_hz
    remark = rise_remark(response.frequency_hz, speed, measured)
    blocks: list[Figure | Callout] = [
        command_and_angle(analysis.records, limits),
        response_figure(analysis, measured),
    ]
    if remark:
        blocks.append(Callout("warn", "The model beyond what was measured", remark))
    draws = posterior.draws(STEP_DRAWS, np.random.default_rng(0))[:, : len(posterior.axis.parameters)]
    step = step_of_models([posterior.axis.to_model(values) for values in draws], posterior.mean_model())
    blocks.append(step_figure(step, analysis.records[0].units))
    return Section("The axis", tuple(blocks))


def _data_section(analysis: Analysis) -> Section:
    records = [(record, "estimate") for record in analysis.records]
    if analysis.held_out:
        records += [(prediction.record, "held out") for prediction in analysis.predictions]
    units = analysis.records[0].units
    rows = tuple(
        (
            record.name,
            use,
            str(len(record)),
            format_duration(record.duration_s),
            f"{record.sample_rate_hz:g} Hz",
            format_interval(float(record.u.min()), float(record.u.max())),
            format_interval(float(record.y.min()) + record.origin, float(record.y.max()) + record.origin),
        )
        for record, use in records
    )
    treated = [f"{record.name}: {step}" for record, _ in records for step in record.treatment]
    start = (
        "Every record is taken to start at rest."
        if analysis.start == "rest"
        else "The initial state of every record is estimated with the model."
    )
    blocks: list[Paragraph | Bullets | Table] = [
        Table(
            (
                "record",
                "used for",
                "samples",
                "length",
                "rate",
                f"command ({units.input})",
                f"output ({units.output})",
            ),
            rows,
            "The records with the range of their columns.",
            (2, 3, 4),
        ),
        Paragraph(start),
    ]
    if treated:
        blocks += [Paragraph("What was done to the data after reading:"), Bullets(tuple(treated))]
    else:
        blocks.append(Paragraph("Nothing was done to the data after reading."))
    blocks.append(
        Table(
            ("record", "nominal", "achieved", "95 % interval", "effective samples"),
            tuple(_coverage_row(name, covered) for name, covered in analysis.coverages),
            "Share of samples inside the equal-tailed predictive bands, noise included.",
            (1, 2, 3, 4),
        )
    )
    return Section("Data", tuple(blocks), folded=True)


def _model_section() -> Section:
    return Section(
        "Model",
        (
            Equation(
                equations.CASCADE, "u is the command, y the measured output, all in the units of the records."
            ),
            Equation(
                equations.SATURATION, "The gains c₁, c₂, c₃ of the static blocks are one (normalization)."
            ),
            Equation(
                equations.LINEAR_BLOCK, "With an integrator, a pole at z = 1, where the records show one."
            ),
            Equation(equations.DEAD_ZONE, "The dead zone simplifies backlash and friction of the gears."),
            Equation(equations.MODE_POLE, "A dominant mode has frequency f and damping ratio ζ."),
            Equation(equations.FIT, "Fit percentage (eq. 14)."),
            Equation(
                equations.NOISE, "The noise is coloured; its order is chosen by the criterion of Schwarz."
            ),
            Paragraph(
                "Source: Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, eqs. 1 to 5."
            ),
        ),
        folded=True,
    )


def predicted_record_of(prediction: Prediction) -> PredictedRecord:
    """A prediction as its figures take it, times counted from the first sample; where nothing was measured
    the record is drawn as predicted, and so not seen."""
    record = prediction.record
    return PredictedRecord(
        name=record.name,
        t=record.t - record.t[0],
        y=np.where(record.measured_samples, record.y, prediction.mean),
        mean=prediction.mean,
        parameters_lower=prediction.lower_parameters,
        parameters_upper=prediction.upper_parameters,
        noise_lower=prediction.lower,
        noise_upper=prediction.upper,
        units=record.units,
        probability=INTERVAL_PROBABILITY,
    )


def _overview(analysis: Analysis, prediction: Prediction) -> Figure:
    return predicted_overview(predicted_record_of(prediction), _kind(analysis))


def _prediction_figure(analysis: Analysis, prediction: Prediction) -> Figure:
    return predicted_record(predicted_record_of(prediction), _hardest(prediction), _kind(analysis))


def _hardest(prediction: Prediction) -> tuple[float, float]:
    """The stretch of largest errors, in s from the record's first sample."""
    begin = float(prediction.record.t[0])
    start, end = prediction.hardest_stretch(ZOOM_SHARE)
    return start - begin, end - begin


def _kind(analysis: Analysis) -> str:
    return "held-out record" if analysis.held_out else "training record"


def _prediction_section(analysis: Analysis) -> Section:
    rows = tuple(
        CoverageRow(
            f"{name}, {format_percent(covered.nominal)}",
            covered.nominal,
            covered.achieved,
            covered.interval[0],
            covered.interval[1],
        )
        for name, covered in analysis.coverages
    )
    blocks: list[Paragraph | Figure | Table | ZoomableRecord | Equation | Callout] = []
    if not analysis.held_out:
        blocks.append(
            Callout(
                "warn",
                "No record was held out",
                "The bands are shown on a record that the model was fitted to: their coverage says little. "
                "Give a record with --holdout.",
            )
        )
    if analysis.fits:
        blocks += [
            Table(
                ("record", "Hammerstein-Wiener", "linear"),
                tuple(
                    (f.record, *(format_percent(x / 100, 1) for x in (f.hammerstein_wiener, f.linear)))
                    for f in analysis.fits
                ),
                "Fit (eq. 14) of the point estimates on records not used for them. The linear model had the "
                "same choice of order and delay, the same refinement, and an offset of its own.",
                (1, 2),
            ),
        ]
    first = analysis.predictions[0]
    blocks.append(
        ZoomableRecord(
            first.record.t - first.record.t[0],
            np.where(first.record.measured_samples, first.record.y, first.mean),
            first.mean,
            first.lower,
            first.upper,
            first.record.units.time,
            first.record.units.output,
            f"{format_percent(INTERVAL_PROBABILITY)} band of y",
            _prediction_figure(analysis, first),
            first.record.name,
        )
    )
    blocks += [_prediction_figure(analysis, prediction) for prediction in analysis.predictions[1:]]
    blocks += [
        coverage_figure(rows, "95 % interval (binomial, effective sample size)"),
        errors_figure(
            errors_of_residuals(analysis.records, analysis.inference.residuals.residuals),
            analysis.records[0].units.output,
        ),
    ]
    return Section("Prediction", tuple(blocks))


def _coverage_row(name: str, covered: Coverage) -> tuple[str, ...]:
    low, high = covered.interval
    return (
        name,
        format_percent(covered.nominal),
        format_percent(covered.achieved, 1),
        f"{format_percent(low, 1)} to {format_percent(high, 1)}",
        f"{covered.effective_samples:.0f}",
    )


def _limits_section(analysis: Analysis) -> Section:
    items = [
        "The gains of the three blocks cannot be told apart from input and output: c₁ = c₂ = c₃ = 1 is set. "
        "For c₁ and c₂ that is a normalization; c₃ = c₂ (equal gains on both sides of the dead zone) is an "
        "assumption that was not tested here.",
        "Effects outside the model (backlash with memory, friction, wind, encoder errors) are seen only as "
        "far as the residual tests see them.",
        "Order and delay of G are those chosen; slow poles that the evidence cannot exclude are kept in "
        "the model, and all roots are free.",
    ]
    held = [name.replace("_pole", " pole ") for name in analysis.inference.posterior.axis.held_poles]
    if held:
        items.append(
            f"The records hardly tell where {' and '.join(held)} of G lies: it stays where the estimate has "
            "it, its weight is free."
        )
    items += [
        f"Not estimated, but taken as known: {known}."
        for known in analysis.inference.posterior.conditional_on
    ]
    return Section("What was not checked", (Bullets(tuple(items)),), folded=True)
