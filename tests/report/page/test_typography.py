"""Plain text of the computing modules as a page sets it."""

from __future__ import annotations

import pytest

from bayes_hw.report.page.typography import squared_unit, typeset, typeset_unit


@pytest.mark.parametrize(("plain", "shown"), [
    ("rms 4.396e-05 deg", "rms 4.396 × 10⁻⁵ deg"),
    ("falls by 1.4e-10 at most", "falls by 1.4 × 10⁻¹⁰ at most"),
    ("-1e+06", "−1 × 10⁶"),
    ("changes the criterion by -5 (bound 10)", "changes the criterion by −5 (bound 10)"),
    ("median -0.8 deg/s", "median −0.8 deg/s"),
    ("uniform between -1 and 1", "uniform between −1 and 1"),
    ("torque 3.93 +- 0.06 deg/s^2", "torque 3.93 ± 0.06 deg/s²"),
    ("0.4 deg/s^2. With it", "0.4 deg/s². With it"),
    ("torque = -F (1 + a exp(-(v / v_s)^2)) sign(v)", "torque = −F (1 + a exp(−(v / v_s)²)) sign(v)"),
    ("a = -F sign(v) - B v", "a = −F sign(v) − B v"),
])  # fmt: skip
def test_numbers_and_formulas_are_set(plain: str, shown: str) -> None:
    assert typeset(plain).replace("\u00a0", " ") == shown


@pytest.mark.parametrize(
    "text",
    [
        "give a record with --holdout",
        "held-out",
        "AR-1",
        "doi 10.1016/0005-1098(94)90209-7",
        "2e",
        "v1.e3",
        "x-1",
    ],
)
def test_words_names_and_options_stay(text: str) -> None:
    assert typeset(text) == text


def test_units() -> None:
    assert typeset_unit("deg/s^2") == "deg/s²"
    assert typeset_unit("1/m^2") == "1/m²"
    assert [squared_unit(unit) for unit in ("deg", "deg/s", "")] == ["deg²", "(deg/s)²", ""]
