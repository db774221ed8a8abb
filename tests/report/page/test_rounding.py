import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.report.page.rounding import (
    format_duration,
    format_estimate,
    format_interval,
    format_number,
    format_p_value,
    format_percent,
    format_value,
)


def spaced(text):
    return text.replace("\u00a0", " ")


@pytest.mark.parametrize(
    ("mean", "sd", "unit", "expected"),
    [
        (0.43812, 0.01234, "deg/s", "0.438 ± 0.012 deg/s"),
        (-0.335, 0.0996, "", "−0.34 ± 0.10"),
        (123456.0, 2345.0, "Hz", "123500 ± 2300 Hz"),
        (4.8281e-6, 3.1e-8, "s", "(4.828 ± 0.031) × 10⁻⁶ s"),
        (2.5e9, 1.2e8, "", "(2.50 ± 0.12) × 10⁹"),
        (-0.0001, 0.5, "", "0.00 ± 0.50"),
        (1.5, 0.0, "deg", "1.50 deg (held)"),
        (1.5, math.nan, "deg", "1.50 deg (spread unknown)"),
        (math.nan, 0.1, "", "not known (spread unknown)"),
    ],
)
def test_estimate_keeps_two_digits_of_its_sd(mean, sd, unit, expected):
    assert spaced(format_estimate(mean, sd, unit)) == expected


@pytest.mark.parametrize(
    ("lower", "upper", "expected"),
    [
        (0.41234, 0.46412, "[0.412, 0.464]"),
        (-1.0, 99.0, "[−1, 99]"),
        (3.2e-7, 5.9e-7, "[3.2, 5.9] × 10⁻⁷"),
        (0.0, 0.0, "[0.00, 0.00]"),
        (0.0, math.inf, "[0.00, ∞]"),
    ],
)
def test_interval_is_rounded_by_its_width(lower, upper, expected):
    assert spaced(format_interval(lower, upper)) == expected


def test_number_keeps_its_significant_digits():
    assert [format_number(value) for value in (0.0, 3.14159, -12345.0)] == ["0.00", "3.14", "−12300"]
    assert spaced(format_number(1.2e-7, 2)) == "1.2 × 10⁻⁷"


def test_value_stands_alone_at_the_place_of_its_uncertainty():
    assert format_value(0.43812, 0.01234) == "0.438"


@pytest.mark.parametrize(
    ("fraction", "decimals", "expected"),
    [
        (0.94, 0, "94 %"),
        (0.9473, 1, "94.7 %"),
        (1.0, 0, "100 %"),
        (0.9999, 0, "> 99 %"),
        (1e-5, 1, "< 0.1 %"),
        (0.0, 1, "0.0 %"),
        (math.nan, 0, "not known"),
    ],
)
def test_percentage_is_never_certain_by_rounding(fraction, decimals, expected):
    assert spaced(format_percent(fraction, decimals)) == expected


def test_duration_reads_in_its_own_units():
    seconds = [1.24, 41.0, 200.0, 7500.0]
    assert [format_duration(s) for s in seconds] == ["1.2 s", "41 s", "3 min 20 s", "2 h 5 min"]


@given(
    st.floats(-1e8, 1e8),
    st.floats(1e-8, 1e8),
)
def test_printed_estimate_lies_within_a_tenth_of_its_sd(mean, sd):
    text = spaced(format_estimate(mean, sd)).replace("−", "-")
    mantissa, _, power = text.partition(" × 10")
    digits = power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    scale = 10.0 ** int(digits or 0)
    shown_mean, shown_sd = (float(part) * scale for part in mantissa.strip("()").split(" ± "))
    assert abs(shown_mean - mean) <= 0.0501 * sd + 1e-12 * abs(mean)
    assert abs(shown_sd - sd) <= 0.0501 * sd


@pytest.mark.parametrize(
    ("p_value", "expected"),
    [(1.0, "1.0"), (0.934, "0.93"), (0.00012, "0.00012"), (5.7e-176, "<\u00a00.0001")],
)
def test_p_value_is_not_told_apart_from_smaller_ones(p_value, expected):
    assert format_p_value(p_value) == expected
