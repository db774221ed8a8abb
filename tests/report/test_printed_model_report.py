"""The verdict on the printed model follows the draws: what is open is said to be open."""

import numpy as np
import pytest
from pages.printed_model_report import Choice, PrintedModel, printed_model_report
from printed.eq12 import (
    SLOW_POLE_LIMIT,
    nanshan_rounding_box,
    nanshan_rounding_uncertainty,
    printed_coefficients,
)
from printed.nanshan import SAMPLE_RATE_HZ, nanshan_model
from printed.rounding_box import roots_of_rows

from bayes_hw.model.linear import polynomial_roots
from bayes_hw.provenance import provenance
from bayes_hw.report.page.render import to_html


@pytest.fixture(scope="module")
def report():
    rng = np.random.default_rng(1)
    box, axis = nanshan_rounding_box(), nanshan_model()
    _, members = box.sample(rng, 50)
    model = PrintedModel(
        box=box,
        printed_poles=polynomial_roots(printed_coefficients()[1]),
        box_poles=roots_of_rows(members),
        representative=axis.linear,
        modes=axis.dominant_modes,
        slow_pole_limit=SLOW_POLE_LIMIT,
        choices=(Choice(0.991, axis.linear, 0.28), Choice(0.985, None, float("nan"), "no member")),
        readings={"four digits": nanshan_rounding_uncertainty(rng, 2000, np.array([0.01, 0.1, 1.0]))},
        sample_rate_hz=SAMPLE_RATE_HZ,
        units=axis.units,
    )
    return printed_model_report(model, provenance("test", 1, [], 1.0))


def test_verdict_says_what_diverges_and_what_is_open(report):
    assert report.verdict.startswith("As printed the model diverges: a pole lies at modulus 1.0495")
    assert "even its sign is open" in report.verdict
    assert [badge.state for badge in report.badges] == ["bad", "good", "warn", "good"]


def test_page_shows_representative_and_refused_choice(report):
    page = to_html(report)
    assert "displacement (half widths)" in page
    assert ">none<" in page
    assert "3.2914, 3.6565" in page
