"""Parameter names as a reader sees them: words for captions, symbols for crowded axes."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from bayes_hw.gap.effects.words import PARAMETER_WORDS
from bayes_hw.model.priors import HalfNormal, LogNormal, Normal, Prior, Uniform
from bayes_hw.report.page.rounding import format_number
from bayes_hw.report.page.typography import typeset

SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")

_FIXED = {
    "saturation.lower": ("lower saturation limit", "s₋"),
    "saturation.upper": ("upper saturation limit", "s₊"),
    "dead_zone.half_width": ("dead-zone half width", "δ"),
    "gain": ("gain of G", "g"),
    "noise.sigma": ("noise standard deviation", "σ"),
    "noise.innovation_sigma": ("standard deviation of the noise's innovations", "σₐ"),
    "velocity_gain": ("velocity gain", "K"),
    "direct": ("direct weight of G", "d"),
    "saturation.gain": ("slope c₁ of the saturation", "c₁"),
    "dead_zone.gain_positive": ("slope c₂ above the dead zone", "c₂"),
    "dead_zone.gain_negative": ("slope c₃ below the dead zone", "c₃"),
    "dead_zone.half_width_negative": ("negative threshold of the dead zone", "δ₋"),
    "lower/c1": ("lower limit in command units", "s₋ / c₁"),
    "upper/c1": ("upper limit in command units", "s₊ / c₁"),
    "c1 g c2": ("gain from command to output", "c₁ g c₂"),
    "c2 delta+": ("positive threshold in output units", "c₂ δ₊"),
    "c3 delta-": ("negative threshold in output units", "c₃ δ₋"),
    "c3/c2": ("ratio of the slopes of the dead zone", "c₃ / c₂"),
    "delta+/delta-": ("ratio of the thresholds", "δ₊ / δ₋"),
}
_NUMBERED = {
    r"mode(\d+)\.frequency_hz": ("frequency of mode {}", "f{}"),
    r"mode(\d+)\.damping_ratio": ("damping ratio of mode {}", "ζ{}"),
    r"noise\.autoregression(\d+)": ("noise AR coefficient {}", "φ{}"),
    r"noise\.partial_autocorrelation(\d+)": ("noise partial autocorrelation {}", "κ{}"),
    r"real_pole(\d+)\.value": ("real pole {}", "p{}"),
    r"real_pole(\d+)\.weight": ("weight of real pole {}", "r{}"),
    r"mode(\d+)\.cosine": ("cosine weight of mode {}", "c{}"),
    r"mode(\d+)\.sine": ("sine weight of mode {}", "s{}"),
    r"pole_pair(\d+)\.frequency_hz": ("frequency of pole pair {}", "F{}"),
    r"pole_pair(\d+)\.damping_ratio": ("damping ratio of pole pair {}", "Z{}"),
    r"start(\d+)\.position": ("initial position of record {}", "y₀{}"),
    r"start(\d+)\.real_pole(\d+)": ("free response of real pole {1}, record {0}", "a{1},{0}"),
    r"start(\d+)\.pair(\d+)\.cosine": ("free response of pair {1} (cosine), record {0}", "A{1},{0}"),
    r"start(\d+)\.pair(\d+)\.sine": ("free response of pair {1} (sine), record {0}", "B{1},{0}"),
}


class ParameterName(NamedTuple):
    """A parameter in words ("frequency of mode 1") and as a symbol ("f₁")."""

    words: str
    symbol: str


def parameter_name(name: str) -> ParameterName:
    """The reader's form of a name of posterior.json; an unknown name stands for itself."""
    if name in _FIXED:
        return ParameterName(*_FIXED[name])
    for pattern, (words, symbol) in _NUMBERED.items():
        if match := re.fullmatch(pattern, name):
            numbers = match.groups()
            small = (number.translate(SUBSCRIPTS) for number in numbers)
            return ParameterName(words.format(*numbers), symbol.format(*small))
    label, _, own = name.partition(".")
    if own in PARAMETER_WORDS:
        return ParameterName(f"{label.replace('_', ' ')}: {PARAMETER_WORDS[own]}", name)
    return ParameterName(name, name)


SIZES_OF_COMMANDS = frozenset({"amplitude", "rms", "top_level"})
UNIT_ENDINGS = {"hz": "Hz", "s": "s", "rad": "rad"}


def setting_words(name: str) -> str:
    """The reader's form of a setting of a command, without the unit that its name ends in."""
    return _without_unit(name)[0].replace("_", " ")


def setting_unit(name: str, input_unit: str) -> str:
    """The unit of a setting of a command, that of the command for its sizes; empty for shares."""
    return input_unit if name in SIZES_OF_COMMANDS else _without_unit(name)[1]


def _without_unit(name: str) -> tuple[str, str]:
    stem, _, ending = name.rpartition("_")
    return (stem, UNIT_ENDINGS[ending]) if stem and ending in UNIT_ENDINGS else (name, "")


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
