"""The report for a controller designer: from a design to a document."""

from __future__ import annotations

import numpy as np

from bayes_hw.control.design import Design, LoopReport
from bayes_hw.control.tuning import lower_bandwidth
from bayes_hw.phrases import listed
from bayes_hw.provenance import Provenance
from bayes_hw.report.design.design_axis_sections import axis_section, controllers_section, crossover_section
from bayes_hw.report.design.design_loop_sections import (
    cycles_section,
    margins_section,
    sets_section,
    tracking_section,
    tuning_section,
)
from bayes_hw.report.design.figures_control_loop import margin_distributions
from bayes_hw.report.page.document import Badge, Bullets, KeyValues, Paragraph, Report, Section, State, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_number, format_percent

SURE = 0.999


def design_report(design: Design, provenance: Provenance) -> Report:
    """The report whose first page answers: which controllers keep their margins, and how surely?"""
    sections = [
        _answer_section(design),
        _method_section(design),
        axis_section(design),
        crossover_section(design),
        controllers_section(design),
        margins_section(design),
        cycles_section(design),
        tracking_section(design),
        sets_section(design),
    ]
    if design.tunings:
        sections.append(tuning_section(design))
    return Report(
        title=f"{design.posterior.axis.model.name}: what a controller can rely on",
        subtitle="Position loops around the posterior of a Hammerstein-Wiener axis",
        verdict=_verdict(design),
        badges=_badges(design),
        key_figure=margin_distributions(design.loops, design.settings.requirements),
        sections=(
            *sections,
            _limits_section(design),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(design: Design) -> str:
    settings = design.settings
    sentences = []
    if not design.posterior.converged:
        sentences.append(
            "The posterior has NOT converged; no probability below is to be relied on: "
            f"{design.posterior.problems[0]}."
        )
    if design.posterior.failed_tests:
        sentences.append(
            "The model does NOT hold, what it leaves of its records refutes it "
            f"({design.posterior.refuted_by[0]}): no probability below is to be relied on."
        )
    if design.effects is not None:
        there = "; it is in every simulation in time" if design.effects.simulated else ""
        sentences.append(f"This axis has {design.effects.words}{there}.")
    requirements, share = settings.requirements, format_percent(settings.share)
    given = [loop for loop in design.loops if not _is_tuned_on_point(design, loop)]
    kept = [loop.controller.name for loop in given if loop.met(requirements) >= settings.share]
    broken = [loop.controller.name for loop in given if loop.met(requirements) < settings.share]
    asked = f"a {requirements.describe()} for at least {share} of the draws"
    if kept:
        missed = f"; {listed(broken)} {'does' if len(broken) == 1 else 'do'} not" if broken else ""
        sentences.append(f"{listed(kept)} {'keeps' if len(kept) == 1 else 'keep'} {asked}{missed}.")
    else:
        sentences.append(f"No controller keeps {asked}.")
    found = [tuning for tuning in design.tunings if tuning.robust.feasible]
    if found:
        breaks = listed([f"{format_percent(t.point.broken, 1)} ({t.structure})" for t in found])
        sentences.append(
            f"Settings tuned on the point estimate alone break them for {breaks} of fresh draws."
        )
    sentences += [
        f"No {tuning.structure} keeps them for at least {share} of the draws."
        for tuning in design.tunings
        if not tuning.robust.feasible
    ]
    return " ".join(sentences)


def _is_tuned_on_point(design: Design, loop: LoopReport) -> bool:
    return any(loop.controller == tuning.point.controller for tuning in design.tunings)


def _answer_section(design: Design) -> Section:
    """The numbers behind the first page, a controller a row."""
    requirements = design.settings.requirements
    return Section(
        "The answer in numbers",
        (
            Table(
                (
                    "controller",
                    "margins kept",
                    "stable",
                    "limit cycle",
                    "bandwidth of at least",
                    "at the point estimate",
                ),
                tuple(
                    (
                        loop.controller.name,
                        format_percent(loop.met(requirements), 1),
                        format_percent(loop.probability_stable, 1),
                        format_percent(_cycling(loop), 1),
                        format_number(lower_bandwidth(loop.margins), 3, "Hz"),
                        "kept" if loop.nominal_margins.meets(requirements)[0] else "not kept",
                    )
                    for loop in design.loops
                ),
                f"Probability over the posterior of a {requirements.describe()}, of a stable loop, and of a "
                "limit cycle in the simulated loop; the bandwidth that 95 % of the draws reach (zero for "
                "unstable ones); and whether the point estimate keeps the margins.",
                (1, 2, 3, 4),
            ),
        ),
    )


def _cycling(loop: LoopReport) -> float:
    """Largest share of simulated draws, over the places, that go on oscillating."""
    return max(float(np.mean(check.simulated.sustained)) for check in loop.cycles)


def _badges(design: Design) -> tuple[Badge, ...]:
    requirements, posterior = design.settings.requirements, design.posterior
    drawn = f"{design.axis.count} draws for the margins, as many fresh ones for the checks"
    sampled = [
        Badge(
            "posterior converged" if posterior.converged else "posterior not converged",
            "good" if posterior.converged else "bad",
            drawn,
        ),
        Badge(
            "all of G free" if posterior.axis.free == "all" else "other roots of G held",
            "good" if posterior.axis.free == "all" else "warn",
            "every pole and zero is sampled"
            if posterior.axis.free == "all"
            else "zeros and the other poles stay as estimated: margins are surer here than they are; sample "
            "with --free all",
        ),
    ]
    if design.effects is not None:
        sampled = [Badge("draws of the corrected model", "good", drawn)]
    badges = [*_holds(design), *sampled]
    weak = dict.fromkeys((*posterior.unreached, *posterior.prior_dominated))
    if weak:
        names = ", ".join(parameter_name(name).words for name in weak)
        badges.append(Badge("not all shown", "warn", f"the prior decides on: {names}"))
    for loop in design.loops:
        if _is_tuned_on_point(design, loop):
            continue
        met = loop.met(requirements)
        state: State = "good" if met >= design.settings.share else "warn"
        if loop.probability_stable < SURE:
            state = "bad"
        badges.append(
            Badge(
                f"{format_percent(met, 1)} keep the margins",
                state,
                f"{loop.controller.name}; {format_percent(loop.probability_stable, 1)} of the draws are "
                "stable",
            )
        )
    return tuple(badges)


def _holds(design: Design) -> tuple[Badge, ...]:
    """Whether the model itself holds, and what was added to it: the first card."""
    failed, effects = design.posterior.refuted_by, design.effects
    if failed:
        return (Badge("the model does not hold", "bad", "; ".join(failed[:2])),)
    if effects is None:
        return ()
    if not effects.answer:
        return (Badge("nothing is missing", "good", "no effect was found beside the linear part"),)
    state: State = "good" if effects.simulated and "other" not in effects.answer else "bad"
    where = (
        "in limit cycles and tracking; margins are those of the linear part"
        if effects.simulated
        else "it is random and in no simulation: margins hold, tracking does not count it"
    )
    return (Badge(effects.words, state, where),)


def _method_section(design: Design) -> Section:
    units, settings = design.nominal.units, design.settings
    return Section(
        "What was done",
        (
            Paragraph(
                f"The loop is closed around the identified axis: error r − y in {units.output}, command u in "
                f"{units.input}, u limited to v, w = G(z) v, y = n(w). Every draw of the posterior is one "
                "axis that the records allow; every number below is computed for each draw, so that its "
                "spread is what the records leave open. Margins are those of the linear loop L = C G, where "
                "neither the limits nor the dead zone bend; stability is decided by the poles of the closed "
                "loop. Limit cycles and tracking are of the whole nonlinear loop."
            ),
            Paragraph(
                f"Probabilities are shares of {design.axis.count} draws; searches use "
                f"{settings.search_draws}, simulations {settings.simulated_draws}. “Point estimate” is the "
                "least-squares model that sampling started from, all that a designer without a posterior "
                "has. A controller slower than the model sees G through its own hold exactly; a faster one "
                "is refused, since the model says nothing between its samples."
            ),
        ),
    )


def _limits_section(design: Design) -> Section:
    rate = design.nominal.sample_rate_hz
    return Section(
        "What this does not show",
        (
            Bullets(
                (
                    "The model's own error: what the records show and the model lacks (see the residual "
                    "tests and the gap between simulator and records) is not in these margins.",
                    "Frequencies that the records do not excite: there the response rests on the model's "
                    "form and the priors, and a margin taken there (see the phase crossover) is as good as "
                    "those.",
                    f"The whole delay of the model is not sampled. It is known to a sample ({1 / rate:g} s) "
                    "at best, which the delay margin has to cover.",
                    "Describing functions assume that the position is nearly a sinusoid; with fewer than "
                    f"four samples a period (above {rate / 4:g} Hz) or with the rate-of-change limit reached "
                    "they are rough, and the simulation decides.",
                    "The dead zone of the model is static and lies about zero of the position; backlash with "
                    "memory acts at every reversal, wherever the axis stands.",
                )
            ),
        ),
    )
