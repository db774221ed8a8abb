"""Every prior of the program has a short form that names its numbers."""

import numpy as np
import pytest

from bayes_hw.model.priors import HalfNormal, LogNormal, Normal, Uniform
from bayes_hw.report.page.names import prior_notation


@pytest.mark.parametrize(
    ("prior", "text"),
    [
        (Normal(-0.5, 0.02), "N(−0.500, 0.0200)"),
        (LogNormal(-0.335, np.log(2.0)), "LN(−0.335, ×÷\u00a02.00)"),
        (HalfNormal(0.018), "HN(0.0180)"),
        (Uniform(-1.0, 1.0), "U(−1.0, 1.0)"),
    ],
)
def test_notation(prior, text):
    assert prior_notation(prior) == text
