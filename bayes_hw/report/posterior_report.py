"""The report on one axis: from an analysis to a document."""

from __future__ import annotations

from bayes_hw.analysis import Analysis
from bayes_hw.infer.prediction import Coverage, Prediction
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.provenance import Provenance
from bayes_hw.report import equations
from bayes_hw.report.document import (
    Badge,
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
from bayes_hw.report.estimate_sections import estimate_sections
from bayes_hw.report.figures_prediction import Coverage as CoverageRow
from bayes_hw.report.figures_prediction import PredictedRecord, predicted_record
from bayes_hw.report.figures_prediction import coverage as coverage_figure
from bayes_hw.report.posterior_sections import posterior_sections, widest_ratio
from bayes_hw.report.rounding import format_duration, format_estimate, format_interval, format_percent

ZOOM_SHARE = 0.1


def posterior_report(analysis: Analysis, provenance: Provenance) -> Report:
    """The report whose first page answers: how good is the model, how sure are its numbers."""
    return Report(
        title=analysis.title,
        subtitle="Hammerstein-Wiener model of a servo axis with posterior uncertainty",
        verdict=_verdict(analysis),
        badges=_badges(analysis),
        key_figure=_prediction_figure(analysis, analysis.predictions[0]),
        sections=(
            _data_section(analysis),
            _model_section(),
            *estimate_sections(analysis),
            *posterior_sections(analysis),
            _prediction_section(analysis),
            _limits_section(analysis),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(analysis: Analysis) -> str:
    """The answer in words; what is wrong comes first."""
    posterior = analysis.dominant.posterior
    sentences = []
    if not posterior.converged:
        sentences.append(
            "The sampler has NOT converged; no interval below is to be relied on: "
            + posterior.problems[0]
            + "."
        )
    disagreements = [test for test in analysis.dominant.residuals.tests if not test.passed]
    if disagreements:
        sentences.append(
            "Model and records disagree: "
            + "; ".join(f"{test.name}: {test.meaning}" for test in disagreements)
            + "."
        )
    identification = analysis.identification
    hidden = (
        [shown.reason for shown in identification.blocks_shown.values() if not shown.shown]
        if identification is not None
        else []
    )
    if hidden:
        sentences.append("Not shown by these records: " + "; ".join(hidden) + ".")
    prediction = analysis.predictions[0]
    place = "a record it has not seen" if analysis.held_out else "its last training record"
    against = ""
    if analysis.fits:
        against = f" (the best linear model: {analysis.fits[0].linear:.1f} %)"
    sentences.append(
        f"The Hammerstein-Wiener model predicts {place} with a fit of {prediction.fit_percent:.1f} %{against}."
    )
    summaries = posterior.summaries
    modes = [name for name in summaries if name.startswith("mode") and name.endswith("frequency_hz")]
    parts = [
        f"limits {format_estimate(summaries[name].mean, summaries[name].sd, summaries[name].unit)}"
        if name == "saturation.lower"
        else format_estimate(summaries[name].mean, summaries[name].sd, summaries[name].unit)
        for name in ("saturation.lower", "saturation.upper")
    ]
    half_width = summaries["dead_zone.half_width"]
    sentences.append(
        " and ".join(parts)[0].upper()
        + " and ".join(parts)[1:]
        + f"; dead zone ±{format_estimate(half_width.mean, half_width.sd, half_width.unit)}"
        + (
            "; resonances at "
            + ", ".join(format_estimate(summaries[n].mean, summaries[n].sd, summaries[n].unit) for n in modes)
            if modes
            else ""
        )
        + " (mean ± standard deviation)."
    )
    if analysis.everything is not None:
        ratio = widest_ratio(posterior.summaries, analysis.everything.posterior.summaries)
        sentences.append(
            "These hold for the other roots of G as estimated; with all of G free the intervals are up to "
            f"{ratio:.1f} times as wide."
        )
    return " ".join(sentences)


def _badges(analysis: Analysis) -> tuple[Badge, ...]:
    posterior, residuals = analysis.dominant.posterior, analysis.dominant.residuals
    summaries = posterior.summaries.values()
    worst_r_hat = max(summary.r_hat for summary in summaries)
    smallest = min(min(summary.ess_bulk, summary.ess_tail) for summary in summaries)
    converged = Badge(
        "converged" if posterior.converged else "not converged",
        "good" if posterior.converged else "bad",
        f"nested R-hat {worst_r_hat:.3f}, {smallest:.0f} effective samples or more",
    )
    white = Badge(
        "residuals white" if residuals.white else "residuals not white",
        "good" if residuals.white else "bad",
        "; ".join(f"{test.name}: p = {test.p_value:.2g}" for test in residuals.tests[:2]),
    )
    name, covered = next((n, c) for n, c in analysis.coverages if c.nominal == INTERVAL_PROBABILITY)
    bands = Badge(
        "bands cover" if covered.agrees else "bands do not cover",
        "good" if covered.agrees else "warn",
        f"{format_percent(covered.nominal)} bands hold {format_percent(covered.achieved, 1)} of {name}"
        f" ({'held out' if analysis.held_out else 'not held out'})",
    )
    identification = analysis.identification
    if identification is None:
        return (converged, white, bands)
    hidden = [key for key, shown in identification.blocks_shown.items() if not shown.shown]
    blocks = Badge(
        "all blocks shown" if not hidden else f"{len(hidden)} block(s) not shown",
        "good" if not hidden else "warn",
        "the records reach both limits and the dead zone" if not hidden else ", ".join(hidden),
    )
    return (converged, white, bands, blocks)


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
            format_interval(float(record.y.min()), float(record.y.max())),
        )
        for record, use in records
    )
    treated = [f"{record.name}: {step}" for record, _ in records for step in record.treatment]
    start = (
        "Every record is taken to start at rest at zero."
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
    return Section("Data", tuple(blocks))


def _model_section() -> Section:
    return Section(
        "Model",
        (
            Equation(
                equations.CASCADE, "u is the command, y the measured angle, all in the units of the records."
            ),
            Equation(
                equations.SATURATION, "The gains c₁, c₂, c₃ of the static blocks are one (normalization)."
            ),
            Equation(
                equations.LINEAR_BLOCK, "With an integrator, a pole at z = 1, where the records show one."
            ),
            Equation(equations.DEAD_ZONE, "The dead zone simplifies backlash and friction of the gears."),
            Equation(equations.MODE_POLE, "A dominant mode has frequency f and damping ratio ζ."),
            Equation(
                equations.NOISE, "The noise is coloured; its order is chosen by the criterion of Schwarz."
            ),
            Paragraph(
                "Source: Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, eqs. 1 to 5."
            ),
        ),
    )


def _predicted(prediction: Prediction) -> PredictedRecord:
    record = prediction.record
    return PredictedRecord(
        name=record.name,
        t=record.t,
        y=record.y,
        mean=prediction.mean,
        parameters_lower=prediction.lower_parameters,
        parameters_upper=prediction.upper_parameters,
        noise_lower=prediction.lower,
        noise_upper=prediction.upper,
        units=record.units,
        probability=INTERVAL_PROBABILITY,
    )


def _prediction_figure(analysis: Analysis, prediction: Prediction) -> Figure:
    record = prediction.record
    what = "held-out record" if analysis.held_out else "training record"
    return predicted_record(
        _predicted(prediction), prediction.hardest_stretch(ZOOM_SHARE), f"{what} {record.name}"
    )


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
            Equation(equations.FIT, "Fit percentage (eq. 14)."),
            Table(
                ("record", "Hammerstein-Wiener", "linear"),
                tuple(
                    (f.record, f"{f.hammerstein_wiener:.1f} %", f"{f.linear:.1f} %") for f in analysis.fits
                ),
                "Fit of the point estimates on records not used for them. The linear model had the same "
                "choice of order and delay, the same refinement, and an offset of its own.",
                (1, 2),
            ),
        ]
    first = analysis.predictions[0]
    blocks.append(
        ZoomableRecord(
            first.record.t,
            first.record.y,
            first.mean,
            first.lower,
            first.upper,
            first.record.units.time,
            first.record.units.output,
            f"{format_percent(INTERVAL_PROBABILITY)} band of y",
            _prediction_figure(analysis, first),
        )
    )
    blocks += [_prediction_figure(analysis, prediction) for prediction in analysis.predictions[1:]]
    blocks += [
        coverage_figure(rows, "95 % interval (binomial, effective sample size)"),
        Table(
            ("record", "nominal", "achieved", "95 % interval", "effective samples"),
            tuple(_coverage_row(name, covered) for name, covered in analysis.coverages),
            "Share of samples inside the equal-tailed predictive bands, noise included.",
            (1, 2, 3, 4),
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
        "Effects outside the model (backlash with memory, friction, wind, encoder errors) are seen only as far "
        "as the residual tests see them.",
        "The intervals hold for the structure of G that was chosen; its order and delay are not varied.",
    ]
    if analysis.everything is None:
        items.append("The roots of G other than the dominant modes were held at their point estimates.")
    return Section("What was not checked", (Bullets(tuple(items)),))
