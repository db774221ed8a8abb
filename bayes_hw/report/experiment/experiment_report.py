"""The report on a designed experiment."""

from __future__ import annotations

import numpy as np

from bayes_hw.identifiability.experiment_check import TOLERANCE, WidthCheck
from bayes_hw.identifiability.next_experiment import FINAL_DRAWS, SEARCH_DRAWS, Candidate, Design
from bayes_hw.infer.posterior import Posterior
from bayes_hw.phrases import with_article
from bayes_hw.provenance import Provenance
from bayes_hw.report.experiment.figures_experiment import (
    CheckRow,
    GainBar,
    PlayedCommand,
    WidthRow,
    command,
    gains,
    width_check,
    widths,
)
from bayes_hw.report.page import equations
from bayes_hw.report.page.document import (
    Badge,
    Block,
    Bullets,
    Equation,
    Figure,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
)
from bayes_hw.report.page.names import parameter_name, setting_unit, setting_words
from bayes_hw.report.page.rounding import format_duration, format_interval, format_number

SHOWN_IN_VERDICT = 3


def experiment_report(
    title: str, design: Design, posterior: Posterior, check: WidthCheck | None, provenance: Provenance
) -> Report:
    """The report whose first page answers: which experiment next, and what will it tell?"""
    sections = [
        _command_section(design, posterior),
        _candidates_section(design, posterior.axis.model.units.input),
        _interval_section(design, check),
    ]
    if check is not None:
        sections.append(_check_section(check))
    return Report(
        title=f"{title}: the next experiment",
        subtitle="Command of largest expected information within what the axis may do",
        verdict=_verdict(design, check),
        badges=(*_holds(posterior), *_badges(design, check)),
        key_figure=_command_figure(design, posterior),
        sections=(
            *sections,
            _method_section(design),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _holds(posterior: Posterior) -> tuple[Badge, ...]:
    """The first card where tests of the residuals refute the model."""
    if not posterior.failed_tests:
        return ()
    return (Badge("the model does not hold", "bad", "; ".join(posterior.refuted_by[:2])),)


def _verdict(design: Design, check: WidthCheck | None) -> str:
    winner = design.winner
    shrinking = sorted(design.intervals, key=lambda interval: interval.width / interval.width_now)
    most = ", ".join(
        f"{parameter_name(i.name).words} to {format_number(100 * i.width / i.width_now, 2)} %"
        for i in shrinking[:SHOWN_IN_VERDICT]
    )
    sentences = [
        f"Play {with_article(winner.label)} of {format_duration(design.circumstances.duration_s)}: it is "
        f"expected to tell {winner.score:.1f} nats of information about {len(design.about)} parameters"
        + (
            f", where the first record's command again would tell {design.repeated.score:.1f}."
            if design.repeated is not None
            else "."
        ),
        f"The 94 % intervals that should shrink most: {most} of their present width.",
    ]
    if check is not None:
        sentences.append(
            f"Simulated {len(check.obtained)} times and sampled again, the widths obtained "
            + ("agree" if check.passed else "do NOT agree")
            + f" with those predicted within {100 * TOLERANCE:.0f} % (largest deviation "
            f"{100 * check.largest_error:.0f} %)."
        )
    return " ".join(sentences)


def _badges(design: Design, check: WidthCheck | None) -> tuple[Badge, ...]:
    winner = design.winner
    found = [
        Badge(
            "winner",
            "good",
            f"{winner.label}, {winner.score:.1f} ± {_error(winner):.1f} nats",
        )
    ]
    if len(design.candidates) > 1:
        second = design.candidates[1]
        clear = winner.score - second.score > 2 * float(np.hypot(_error(winner), _error(second)))
        found.append(
            Badge(
                "clear winner" if clear else "close second",
                "good" if clear else "warn",
                f"{second.label}, {second.score:.1f} ± {_error(second):.1f} nats",
            )
        )
    if check is not None:
        found.append(
            Badge(
                "prediction confirmed" if check.passed else "prediction not confirmed",
                "good" if check.passed else "bad",
                f"widths within {100 * check.largest_error:.0f} % (limit {100 * TOLERANCE:.0f} %)",
            )
        )
        found.append(
            Badge(
                "converged" if all(check.converged) else "not converged",
                "good" if all(check.converged) else "bad",
                f"{sum(check.converged)} of {len(check.converged)} posteriors of the check",
            )
        )
    return tuple(found)


def _error(candidate: Candidate) -> float:
    return candidate.gain.standard_error if candidate.gain is not None else float("nan")


def _command_figure(design: Design, posterior: Posterior) -> Figure:
    limits, units = design.circumstances.limits, posterior.axis.model.units
    u = design.winner.u
    return command(
        PlayedCommand(
            t=np.arange(len(u)) / design.circumstances.sample_rate_hz,
            u=u,
            outputs=design.outputs,
            velocity_limit=limits.velocity,
            stroke=(limits.lowest, limits.highest),
            believed_limits=(
                posterior.summaries["saturation.lower"].hdi94,
                posterior.summaries["saturation.upper"].hdi94,
            ),
            input_unit=units.input,
            output_unit=units.output,
        ),
        design.winner.label,
    )


def _command_section(design: Design, posterior: Posterior) -> Section:
    limits, units, winner = design.circumstances.limits, posterior.axis.model.units, design.winner
    u, rate = winner.u, design.circumstances.sample_rate_hz
    reached = (
        (
            f"velocity ({units.input})",
            format_number(float(np.max(np.abs(u)))),
            format_number(limits.velocity),
        ),
        (
            f"acceleration ({units.input}/s)",
            format_number(float(np.max(np.abs(np.diff(u, prepend=0.0, append=0.0)))) * rate),
            format_number(limits.acceleration),
        ),
        (
            f"stroke ({units.output})",
            format_interval(float(design.outputs.min()), float(design.outputs.max())),
            format_interval(limits.lowest, limits.highest),
        ),
    )
    return Section(
        "The command",
        (
            Paragraph(
                f"command.csv holds it, {len(u)} samples at {rate:g} Hz in columns t (s) and u "
                f"({units.input}), from rest to rest, ready to play. It starts at w = 0."
            ),
            Table(
                ("setting", "value"),
                tuple(
                    (setting_words(name), format_number(value, unit=setting_unit(name, units.input)))
                    for name, value in winner.settings.items()
                ),
                f"Settings of the {winner.label}"
                + (
                    "."
                    if winner.shrunk_by == 1
                    else f", then made smaller by {winner.shrunk_by:g}: the stroke."
                ),
                (1,),
            ),
            Table(
                ("limit", "reached", "allowed"),
                reached,
                "What the axis may do, and what it is asked to.",
                (1, 2),
            ),
        ),
    )


def _candidates_section(design: Design, unit: str) -> Section:
    bars = [GainBar(c.label, c.score, _error(c), True) for c in design.candidates]
    if design.repeated is not None:
        bars.append(GainBar(design.repeated.label, design.repeated.score, _error(design.repeated), False))
    rows = tuple(
        (
            c.label,
            f"{c.score:.2f} ± {_error(c):.2f}",
            ", ".join(
                f"{setting_words(name)} {format_number(value, 2, setting_unit(name, unit))}"
                for name, value in c.settings.items()
            ),
        )
        for c in design.candidates
    )
    return Section(
        "The candidates",
        (
            gains(bars),
            Table(
                ("family", "gain (nats)", "best settings"),
                rows,
                "The best command of every family, with the standard error over the draws. "
                "Amplitude-modulated and phase-modulated sweeps are the proposal of the paper.",
                (1,),
            ),
        ),
    )


def _interval_section(design: Design, check: WidthCheck | None) -> Section:
    obtained: dict[str, tuple[float, ...]] = {}
    if check is not None:
        obtained = {name: tuple(check.obtained[:, i].tolist()) for i, name in enumerate(check.names)}
    rows = [
        WidthRow(
            parameter_name(i.name).words,
            i.width / i.width_now,
            i.width_range[0] / i.width_now,
            i.width_range[1] / i.width_now,
            tuple(width / i.width_now for width in obtained.get(i.name, ())),
        )
        for i in design.intervals
    ]
    return Section(
        "Predicted intervals",
        (
            widths(rows),
            Table(
                ("parameter", "94 % HDI now", "94 % interval after", "width after / now"),
                tuple(
                    (
                        parameter_name(i.name).words,
                        format_interval(*i.now, i.unit),
                        format_interval(*i.after, i.unit),
                        format_number(i.width / i.width_now, 2),
                    )
                    for i in design.intervals
                ),
                "What the experiment is expected to leave, shown about today's median; where it will lie "
                "only the experiment can tell. The width is the geometric mean over draws of the posterior.",
                (1, 2, 3),
            ),
        ),
    )


def _check_section(check: WidthCheck) -> Section:
    ratios = check.obtained / check.predicted
    rows = [
        CheckRow(parameter_name(name).words, tuple(ratios[:, i].tolist()), float(check.ratio[i]))
        for i, name in enumerate(check.names)
    ]
    return Section(
        "The check",
        (
            width_check(rows, TOLERANCE),
            Table(
                ("parameter", "obtained / predicted", "smallest", "largest"),
                tuple(
                    (row.label, f"{row.mean:.3f}", f"{min(row.ratios):.3f}", f"{max(row.ratios):.3f}")
                    for row in rows
                ),
                f"Widths of 94 % intervals over {len(check.obtained)} simulated experiments, each on an "
                "axis drawn from the posterior and sampled again together with the earlier records.",
                (1, 2, 3),
            ),
        ),
    )


def _method_section(design: Design) -> Section:
    blocks: list[Block] = [
        Equation(
            equations.INFORMATION_GAIN,
            "ψ are the parameters asked about; C is the covariance of the posterior's draws, P(θ) the "
            "precision that prior and earlier records give near the draw θ, and F(θ) the Fisher "
            "information of the experiment, in coordinates where priors are nearly normal.",
        ),
        Paragraph("ψ: " + ", ".join(parameter_name(name).words for name in design.about) + "."),
        Bullets(
            (
                "This is the Laplace approximation; it is exact for a linear model with Gaussian belief "
                "and noise.",
                f"Settings were searched with {SEARCH_DRAWS} draws of the posterior, by differential "
                f"evolution and a simplex; the best of every family were compared with {FINAL_DRAWS} others.",
                "Commands are followed no faster than the acceleration limit; those that any of the "
                "believed axes would answer beyond the stroke are made smaller.",
                "Where a limit may lie beyond every allowed command, its interval after is not Gaussian "
                "and the prediction is rough.",
                "Effects outside the model, and which of them hold, are not part of this gain.",
            )
        ),
    ]
    return Section("Method, and what was not checked", tuple(blocks))
