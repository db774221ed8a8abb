"""Numbers as text, with the digits that their uncertainty supports.

A number and its unit are joined by no-break spaces and keep together on a line.
"""

from __future__ import annotations

import math

from bayes_hw.report.page.typography import MINUS, NO_BREAK_SPACE, power_of_ten, typeset_unit

PLAIN_EXPONENTS = range(-4, 6)
"""Decimal exponents of the leading digit for which a number is written without a power of ten."""

SMALLEST_P_VALUE = 0.0001
"""Below it tests are not told apart: their distributions are not known that far out."""


def format_number(value: float, significant: int = 3, unit: str = "") -> str:
    """`value` to `significant` digits, for numbers whose uncertainty is not stated."""
    if not math.isfinite(value):
        return _append(_not_finite(value), unit)
    exponent = _exponent(value, significant)
    return _append(_scaled([value], "{}", significant - 1 - exponent, exponent), unit)


def format_value(value: float, uncertainty: float, unit: str = "") -> str:
    """`value` alone, to the decimal place of the second significant digit of `uncertainty`."""
    if not _usable(value, uncertainty):
        return format_number(value, 3, unit)
    return _append(_scaled([value], "{}", *_places([value], uncertainty)), unit)


def format_estimate(mean: float, sd: float, unit: str = "") -> str:
    """`mean ± sd`, both to the decimal place of the second significant digit of sd.

    A zero, infinite or missing sd is said in words after three digits of the mean.
    """
    if not _usable(mean, sd):
        note = "held" if sd == 0 else "spread unknown"
        return f"{format_number(mean, 3, unit)} ({note})"
    decimals, exponent = _places([mean, sd], sd)
    return _append(
        _scaled([mean, sd], f"{{}}{NO_BREAK_SPACE}±{NO_BREAK_SPACE}{{}}", decimals, exponent), unit
    )


def format_interval(lower: float, upper: float, unit: str = "") -> str:
    """`[lower, upper]`, rounded at the second significant digit of its half width.

    Each end moves by at most a fortieth of the width.
    """
    width = abs(upper - lower)
    if not (_usable(lower, width) and math.isfinite(upper)):
        ends = f"[{format_number(lower)},{NO_BREAK_SPACE}{format_number(upper)}]"
        return _append(ends, unit)
    decimals, exponent = _places([lower, upper], width / 2)
    return _append(_scaled([lower, upper], f"[{{}},{NO_BREAK_SPACE}{{}}]", decimals, exponent), unit)


def format_p_value(p_value: float) -> str:
    """Two digits of `p_value`, or that it is below SMALLEST_P_VALUE."""
    if p_value < SMALLEST_P_VALUE:
        return f"<{NO_BREAK_SPACE}{SMALLEST_P_VALUE:g}"
    return format_number(p_value, 2)


def format_percent(fraction: float, decimals: int = 0) -> str:
    """`fraction` as a percentage; never 0 % or 100 % for a fraction strictly between."""
    if not math.isfinite(fraction):
        return _not_finite(fraction)
    step = 10.0**-decimals
    percent = 100 * fraction
    if 0 < percent < step / 2:
        return f"<{NO_BREAK_SPACE}{step:.{decimals}f}{NO_BREAK_SPACE}%"
    if 100 - step / 2 < percent < 100:
        return f">{NO_BREAK_SPACE}{100 - step:.{decimals}f}{NO_BREAK_SPACE}%"
    return f"{_signed(percent, decimals)}{NO_BREAK_SPACE}%"


def format_duration(seconds: float) -> str:
    """`seconds` as "41 s", "3 min 20 s" or "2 h 5 min"."""
    if not math.isfinite(seconds):
        return _not_finite(seconds)
    if seconds < 10:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 120:
        return f"{whole} s"
    if whole < 7200:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _usable(value: float, uncertainty: float) -> bool:
    return math.isfinite(value) and math.isfinite(uncertainty) and uncertainty > 0


def _exponent(value: float, significant: int) -> int:
    """Decimal exponent of the leading digit after rounding to `significant` digits."""
    return 0 if value == 0 else int(f"{value:.{significant - 1}e}".split("e")[1])


def _places(values: list[float], uncertainty: float) -> tuple[int, int]:
    """Decimals that keep two digits of `uncertainty`, and the exponent of the largest value."""
    decimals = 1 - _exponent(uncertainty, 2)
    return decimals, _exponent(max(values, key=abs), 3)


def _scaled(values: list[float], template: str, decimals: int, exponent: int) -> str:
    """`values` in `template` with `decimals` places, as a multiple of 10^exponent where that is shorter."""
    if exponent in PLAIN_EXPONENTS:
        return template.format(*(_signed(round(v, decimals), max(decimals, 0)) for v in values))
    shown = template.format(*(_signed(v / 10.0**exponent, max(decimals + exponent, 0)) for v in values))
    if "±" in shown:
        shown = f"({shown})"
    return f"{shown}{NO_BREAK_SPACE}×{NO_BREAK_SPACE}{power_of_ten(exponent)}"


def _signed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", MINUS)


def _not_finite(value: float) -> str:
    if math.isnan(value):
        return "not known"
    return "∞" if value > 0 else f"{MINUS}∞"


def _append(text: str, unit: str) -> str:
    return f"{text}{NO_BREAK_SPACE}{typeset_unit(unit)}" if unit else text
