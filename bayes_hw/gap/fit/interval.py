"""The probability of every interval that a diagnosis states."""

from __future__ import annotations

from scipy.stats import norm

PROBABILITY = 0.94

NORMAL_HALF_WIDTH = float(norm.ppf((1 + PROBABILITY) / 2))
"""Half the width of that interval of a normal variable, in its standard deviations."""
