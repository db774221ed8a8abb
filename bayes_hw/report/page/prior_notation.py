"""Priors in a few characters, for tables."""

from __future__ import annotations

import math

from bayes_hw.model.priors import HalfNormal, LogNormal, Normal, Prior, Uniform
from bayes_hw.report.page.rounding import format_number
from bayes_hw.report.page.typography import typeset

LEGEND = (
    "Priors: N(mean, sd) normal; LN(median, ×÷ factor) log-normal, the factor spanning one standard "
    "deviation; HN(scale) half-normal; U(ends) uniform; all in the parameter's unit."
)


def prior_notation(prior: Prior) -> str:
    """`prior` without its unit, in the notation of LEGEND; one of another kind in its own words."""
    match prior:
        case Normal(mean, sd):
            return f"N({format_number(mean)}, {format_number(sd)})"
        case LogNormal(median, log_sd):
            return f"LN({format_number(median)}, ×÷\u00a0{format_number(math.exp(log_sd))})"
        case HalfNormal(scale):
            return f"HN({format_number(scale)})"
        case Uniform(lower, upper):
            return f"U({format_number(lower, 2)}, {format_number(upper, 2)})"
        case _:
            return typeset(prior.describe(""))
