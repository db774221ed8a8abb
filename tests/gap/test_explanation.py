"""An explanation whose fit has run away explains nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from drive_axis import SIGMA, white
from fitted import SAMPLES, with_residuals

from bayes_hw.gap.explanation import with_stochastic
from bayes_hw.gap.stochastic import StochasticFit, autoregression


def test_a_fit_that_ran_away_has_no_evidence() -> None:
    """Not a number would stand anywhere in a ranking; minus infinity stands last."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    noise = autoregression(fit)
    found = StochasticFit("wind", "", noise, noise.log_likelihood, {})
    assert np.isfinite(with_stochastic(found, fit).log_evidence)
    lost = replace(fit, coordinates=np.full_like(fit.coordinates, np.nan))
    assert with_stochastic(found, lost).log_evidence == -np.inf
