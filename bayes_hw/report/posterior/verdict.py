"""The first page of the report on one axis: its answer in words, and its badges."""

from __future__ import annotations

import numpy as np

from bayes_hw.analysis import Analysis
from bayes_hw.infer.own_check import FEWEST, OwnCheck
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.report.page.document import Badge
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_estimate, format_number, format_p_value, format_percent
from bayes_hw.report.posterior.posterior_sections import conditional_sentence

DEAD_ZONE = "dead_zone.half_width"
LIMITS = ("saturation.lower", "saturation.upper")
REFUTED = (
    "Its numbers are those of a model that does not hold: they stand further down, folded, for comparison "
    "alone."
)

BLOCK_PARAMETERS = {**{name: name for name in LIMITS}, "dead_zone": DEAD_ZONE}
"""The parameter of every block of `Identification.blocks_shown`."""


def verdict(analysis: Analysis) -> str:
    """The answer in words; what is wrong comes first."""
    posterior = analysis.inference.posterior
    sentences = []
    if not posterior.converged:
        sentences.append(
            "The sampler has NOT converged; no interval below is to be relied on: "
            + posterior.problems[0]
            + "."
        )
    disagreements = [test for test in analysis.inference.residuals.tests if not test.passed]
    if disagreements:
        sentences.append(
            "Model and records disagree: " + "; ".join(test.meaning for test in disagreements) + "."
        )
    if not analysis.inference.residuals.explained:
        fit = analysis.inference.residuals.fit_percent
        sentences.append(
            f"The model explains little of the records (fit {format_number(fit, 3)} %): the noise model "
            "carries the rest."
        )
    if disagreements:
        sentences += driven_by_more(analysis)
    if posterior.power < 1:
        sentences.append(
            "The model leaves far more than noise, which coloured noise would carry: errors count as white, "
            f"{format_number(1 / posterior.power, 2)} samples as one."
        )
    feedback = analysis.inference.residuals.feedback
    if feedback.closed_loop:
        sentences.append(_capitalized(feedback.sentence) + ".")
    sentences.append(_fit_sentence(analysis))
    holds = analysis.inference.residuals.white and analysis.inference.residuals.explained
    sentences.append(_estimate_sentence(analysis) if holds else REFUTED)
    if posterior.conditional_on:
        sentences.append(conditional_sentence(posterior))
    return " ".join(sentences)


def driven_by_more(analysis: Analysis) -> list[str]:
    """Which assumption fails and what to do, where a linear model with a constant command simulates the
    records better than the cascade."""
    if analysis.identification is None:
        return []
    fits = analysis.identification.fits
    cascade = float(np.mean([fit.hammerstein_wiener for fit in fits]))
    linear = float(np.mean([fit.linear for fit in fits]))
    if linear <= cascade:
        return []
    return [
        "The assumption that fails is that the clipped command alone drives the axis: a linear model with a "
        f"constant added to the command simulates these records better (fit {format_number(linear, 3)} % "
        f"against {format_number(cascade, 3)} %), as friction or a constant force has it; have them "
        "diagnosed (bayes-hw diagnose), whose catalogue has both, and do not use the numbers below."
    ]


def not_shown(analysis: Analysis) -> frozenset[str]:
    """Parameters about which the records say little: of blocks not shown, or prior-dominated."""
    hidden = set(analysis.inference.posterior.prior_dominated)
    if analysis.identification is not None:
        hidden |= {
            BLOCK_PARAMETERS[block]
            for block, shown in analysis.identification.blocks_shown.items()
            if not shown.shown
        }
    return frozenset(hidden)


def badges(analysis: Analysis) -> tuple[Badge, ...]:
    """The checks of the first page: sampling, residuals, bands, blocks."""
    posterior, residuals = analysis.inference.posterior, analysis.inference.residuals
    summaries = posterior.summaries.values()
    smallest = min(min(summary.ess_bulk, summary.ess_tail) for summary in summaries)
    hidden = [name for name in (*LIMITS, DEAD_ZONE, *_modes(posterior)) if name in not_shown(analysis)]
    smallest_p = min(test.p_value for test in residuals.tests if test.passed or not residuals.white)
    sampled = (
        Badge(
            "sampled to the end" if posterior.converged else "not converged",
            ("warn" if posterior.conditional_on else "good") if posterior.converged else "bad",
            f"{smallest:.0f} independent draws or more of every number"
            + "".join(f"; {problem}" for problem in posterior.problems[:1]),
        ),
    )
    conditional = (Badge("conditional", "warn", f"given {' and '.join(posterior.conditional_on)}"),)
    return (
        Badge(
            "what is left is noise" if residuals.white else "the model does not hold",
            "good" if residuals.white else "bad",
            "; ".join(residuals.failures)
            or f"whiteness and independence of the command, smallest p‑value {format_p_value(smallest_p)}",
        ),
        *(sampled if analysis.check is None or not posterior.converged else ()),
        *(conditional if posterior.conditional_on else ()),
        *(() if analysis.check is None else (_check_badge(analysis.check),)),
        _band_badge(analysis),
        Badge(
            "all blocks shown" if not hidden else "not all shown",
            "good" if not hidden else "warn",
            "the records inform on both limits, the dead zone and the resonances"
            if not hidden
            else "not shown: " + ", ".join(parameter_name(name).words for name in hidden),
        ),
    )


def _check_badge(check: OwnCheck) -> Badge:
    """Whether the intervals hold on simulated axes like this one."""
    whole = check.all_parameters
    said = (
        f"{whole.held} of {whole.of} intervals in {check.replicates} replicates like this axis"
        f" ({check.converged} converged)"
    )
    if check.refuted:
        names = ", ".join(parameter_name(name).words for name in check.refuted)
        return Badge("intervals do not hold", "bad", f"{said}; too seldom: {names}")
    if check.stands:
        return Badge("intervals hold", "good", said)
    return Badge("intervals not judged", "warn", f"{said}; {FEWEST} replicates or more would say")


def _band_badge(analysis: Analysis) -> Badge:
    """Never "bad": the errors of one record are not independent, whatever its length."""
    name, covered = next((n, c) for n, c in analysis.coverages if c.nominal == INTERVAL_PROBABILITY)
    low, high = covered.interval
    return Badge(
        f"bands hold {format_percent(covered.achieved, 1)} of one record",
        "good" if covered.agrees and analysis.held_out else "warn",
        f"{format_percent(covered.nominal)} bands, {name} ({'' if analysis.held_out else 'not '}held out), "
        f"95 % interval {format_percent(low, 1)} to {format_percent(high, 1)}",
    )


def _fit_sentence(analysis: Analysis) -> str:
    """The fit of the point estimate beside the linear model's; the posterior mean's where they differ."""
    mean_fit = analysis.predictions[0].fit_percent
    place = "a record it has not seen" if analysis.held_out else "its last training record"
    if not analysis.fits:
        return f"The Hammerstein-Wiener model predicts {place} with a fit of {_fit(mean_fit)}."
    estimate, linear = analysis.fits[0].hammerstein_wiener, analysis.fits[0].linear
    if _fit(linear) == _fit(estimate):
        against = "as the best linear model does"
    else:
        against = (
            f"{'WORSE than' if linear > estimate else 'against'} {_fit(linear)} of the best linear model"
        )
    mean = f" (its posterior mean: {_fit(mean_fit)})" if abs(mean_fit - estimate) >= 1 else ""
    return f"The Hammerstein-Wiener model predicts {place} with a fit of {_fit(estimate)}{mean}, {against}."


def _fit(percent: float) -> str:
    return format_percent(percent / 100, 1)


def _estimate_sentence(analysis: Analysis) -> str:
    posterior, hidden = analysis.inference.posterior, not_shown(analysis)
    modes = _modes(posterior)
    limits = [name for name in LIMITS if name not in hidden]
    parts = []
    if limits:
        unit = posterior.summaries[limits[0]].unit
        which = f" ({parameter_name(limits[0]).words})" if len(limits) == 1 else ""
        values = [_quantity(posterior, name, "") for name in limits[:-1]]
        parts.append(
            "saturation at " + " and ".join([*values, _quantity(posterior, limits[-1], unit)]) + which
        )
    if DEAD_ZONE not in hidden:
        unit = posterior.summaries[DEAD_ZONE].unit
        parts.append(f"dead zone of half width {_quantity(posterior, DEAD_ZONE, unit)}")
    shown_modes = [name for name in modes if name not in hidden]
    if shown_modes:
        *others, last = (_quantity(posterior, name, "") for name in shown_modes)
        listed = f"{', '.join(others)} and {last}" if others else last
        parts.append(f"resonance{'s' * (len(shown_modes) > 1)} at {listed}\u00a0Hz")
    kind = " (mean ± standard deviation)" if posterior.converged else " (point estimates without intervals)"
    text = _capitalized("; ".join(parts)) + kind + "." if parts else ""
    missing = [parameter_name(name).words for name in (*LIMITS, DEAD_ZONE, *modes) if name in hidden]
    if missing:
        text += f" Not shown by these records: {', '.join(missing)}."
    return text.strip()


def _quantity(posterior: Posterior, name: str, unit: str) -> str:
    """Mean ± sd of a converged posterior; the point estimate alone of one that is not."""
    if not posterior.converged:
        return format_number(float(posterior.point_estimate[posterior.names.index(name)]), 3, unit)
    summary = posterior.summaries[name]
    return format_estimate(summary.mean, summary.sd, unit)


def _modes(posterior: Posterior) -> list[str]:
    return [n for n in posterior.names if n.startswith("mode") and n.endswith("frequency_hz")]


def _capitalized(text: str) -> str:
    return text[:1].upper() + text[1:]
