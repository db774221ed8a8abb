"""Innovations with heavy tails: rare large errors that no form of an effect has exactly.

How a reversal goes within some samples is wrong in every form, and where the encoder resolves it, a few such
samples decide a normal likelihood. Under Student t they count for little, and what explains all other samples
leads.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import BoolArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.structure_moves import pruned, regrown
from bayes_hw.identify.growth.coloured import log_likelihood_of_t
from bayes_hw.identify.growth.descent import innovations, whitened

DEGREES_OF_FREEDOM = (2.0, 3.0, 4.0, 6.0, 10.0, 20.0)
"""That are tried; more are nearly normal."""

NEARLY_NORMAL = 1e6


def tails_of(fit: JointFit, where: Sequence[BoolArray] | None = None) -> tuple[float, float]:
    """Nats by which Student t explains a fit's innovations better than a normal distribution, less half a
    logarithm of the samples, at the best number of degrees of freedom; that number. Of the samples `where`
    (samples,) of every record is true, if given, which were measured."""
    if where is None:
        squares = np.concatenate([a**2 for a in innovations(fit.point)])
    else:
        every = whitened(fit.point, fit.point.residuals)
        both = [mask & told for mask, told in zip(where, fit.response.told, strict=True)]
        squares = np.concatenate([a[mask] ** 2 for a, mask in zip(every, both, strict=True)])
    normal = log_likelihood_of_t(squares, NEARLY_NORMAL)
    nats = [log_likelihood_of_t(squares, n) - normal for n in DEGREES_OF_FREEDOM]
    best = int(np.argmax(nats))
    return nats[best] - 0.5 * float(np.log(len(squares))), DEGREES_OF_FREEDOM[best]


BY_ROUNDING = 2.0
"""Of the root mean square that rounding to a step makes: what is left, up to which it may be that alone."""


def with_heavy_tails(fit: JointFit, asked: float, step: float | None = None) -> JointFit:
    """Under innovations of Student t, descended and its G grown on, where that explains `asked` nats more;
    itself else, and where rounding to `step` may make all that is left: it rests, and then steps."""
    if step is not None and fit.point.rms < BY_ROUNDING * step / np.sqrt(12):
        return fit
    nats, degrees = tails_of(fit)
    if nats < asked:
        return fit
    return regrown(pruned(fit.under(replace(fit.response, degrees_of_freedom=degrees)).descended()))
