"""Every rule decides, in its order, and gives its number and threshold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.identifiability.prior_sensitivity import PowerScaling
from bayes_hw.identifiability.profile import Profile, Side
from bayes_hw.identifiability.verdict import flat_verdicts, verdict_on


def profile(lower: Side, upper: Side) -> Profile:
    values = np.array([0.5, 1.0, 2.0])
    level = np.array([-5.0 if "falls" in lower else -0.3, 0.0, -5.0 if "falls" in upper else -0.4])
    bound = (("mode1.damping_ratio",), (), ())
    return Profile("gain", "", 1.0, values, level, values[:, None], ("gain",), bound, lower, upper)


@pytest.mark.parametrize(
    ("contraction", "sides", "scaling", "verdict", "says"),
    [
        (0.99, ("falls", "falls"), (0.01, 0.1), "identified", "contraction 0.99"),
        (0.3, ("falls", "falls"), (0.01, 0.1), "prior-dominated", "0.3 (threshold 0.5)"),
        (0.99, ("falls", "open"), (0.01, 0.1), "prior-dominated", "falls by 0.4 at most (threshold 1.92)"),
        (
            0.99,
            ("falls at a bound", "falls"),
            (0.01, 0.1),
            "prior-dominated",
            "mode1.damping_ratio at its bound",
        ),
        (0.8, ("falls", "falls"), (0.01, 0.1), "weakly identified", "0.8 (threshold 0.9)"),
        (0.99, ("falls", "falls"), (0.06, 0.1), "weakly identified", "0.06 (threshold 0.05)"),
        (0.99, ("zero", "falls"), (0.01, 0.1), "weakly identified", "may as well be zero"),
    ],
)
def test_rules(
    contraction: float, sides: tuple[Side, Side], scaling: tuple[float, float], verdict: str, says: str
) -> None:
    found = verdict_on("gain", contraction, profile(*sides), PowerScaling(*scaling))
    assert found.verdict == verdict
    assert says in found.reason


def test_a_side_along_which_nothing_falls_says_so() -> None:
    flat = replace(profile("open", "falls"), log_likelihood=np.array([-1e-9, 0.0, -5.0]))
    reason = verdict_on("gain", 0.99, flat).reason
    assert reason.startswith("below the estimate the log-likelihood was not seen to fall (threshold 1.92)")


def test_without_profile_the_contraction_decides() -> None:
    assert verdict_on("noise.sigma", 0.95).verdict == "identified"
    assert verdict_on("noise.sigma", 0.95).to_dict()["prior_sensitivity"] is None


def test_only_directions_in_the_null_space_are_flat() -> None:
    (flat,) = flat_verdicts(("gain", "mode1.frequency_hz"), {"gain": 0.6, "mode1.frequency_hz": 1e-7})
    assert (flat.name, flat.verdict) == ("gain", "exactly flat")
    assert "0.60" in flat.reason


def test_a_side_without_a_point_is_not_said_to_fall() -> None:
    """The estimate is the last point: nothing was followed above it."""
    ended = replace(profile("falls", "open"), estimate=9.0)
    assert (
        "above the estimate the log-likelihood was not seen to fall" in verdict_on("gain", 0.99, ended).reason
    )
