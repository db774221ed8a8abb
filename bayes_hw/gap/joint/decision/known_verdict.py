"""What a diagnosis says of every known input: whether the gap follows it, how, and how far that closes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np
from scipy.special import ndtri

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.posterior.joint_posterior import INFLATION, JointPosterior
from bayes_hw.gap.joint.posterior.reported_quantities import effect_quantities
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.gap.joint.search.known_input import ASKED_NATS, BLOCKS, LABEL, KnownInput
from bayes_hw.identify.growth.descent import triangular_factor
from bayes_hw.model.known_input import READING, TORQUE
from bayes_hw.record import Record

CloseOn: TypeAlias = Callable[[Sequence[Record], JointFit, JointFit], Closure]
"""How far the second fit closes the gap of the first on records."""

WAYS: Mapping[str, str] = {
    TORQUE: "through the load, as a torque",
    READING: "at the encoder, as a part of the reading",
}

DIFFERENCE = 1e-6
"""Of a coordinate: the step of a difference quotient."""

LEVELS = 2000
SINGULAR = 1e-9
"""Of the largest singular value of the scaled derivatives: directions below it change no response."""

MOST_WITHOUT = 0.3
"""Probability of a column that falls short by little."""


def known_verdict(
    found: JointAnswer,
    posterior: JointPosterior,
    train: Sequence[Record],
    holdout: Sequence[Record],
    close_on: CloseOn,
) -> dict[str, dict[str, object]]:
    """The block `known` of verdict.json, a column each: `follows`, `probability`, `nats`; of one that the gap
    follows also `way`, `block`, `gain`, `lag_s`, `gap` and a `sentence`."""
    chain = [one for one in found.known if one.accepted]
    fits = [*(one.without for one in chain if one.without is not None), found.base]
    after = {one.column: fits[i + 1] for i, one in enumerate(chain)}
    return {
        one.column: _followed(one, after[one.column], posterior, train, holdout, close_on)
        if one.accepted
        else {"follows": False, "probability": doubtful(one.nats), "nats": one.nats}
        for one in found.known
    }


def doubtful(nats: float) -> float:
    """Probability of a column that is not worth what is asked."""
    return float(MOST_WITHOUT * np.exp(min(nats - ASKED_NATS, 0.0) / 10))


def _drawn(posterior: JointPosterior, column: str) -> tuple[FloatArray, FloatArray]:
    """Values (n,) at even levels of the normal posteriors of gain and lag in s.

    By the delta method on the whitened derivatives themselves: the weights of a torque's path are poorly
    known one by one, so that single draws of them may lie where its phase is far from linear.
    """
    fit, label = posterior.fit, LABEL + column
    centre = fit.point.coordinates
    steps = DIFFERENCE * np.maximum(np.abs(centre), 1e-3)

    def at(x: FloatArray) -> FloatArray:
        found = effect_quantities(fit, fit.response.values(x))
        return np.array([found[f"{label}.gain"], found[f"{label}.lag"]])

    slopes = np.array([(at(centre + s) - at(centre - s)) / 2 for s in np.diag(steps)]) / steps[:, None]
    factor = triangular_factor(fit.response, fit.point)
    size = len(centre)
    norms = np.sqrt(np.sum(factor[:size, :size] ** 2, axis=0))
    norms[norms == 0] = 1.0
    reached = np.linalg.lstsq((factor[:size, :size] / norms).T, slopes / norms[:, None], rcond=SINGULAR)[0]
    sigma = float(np.sqrt(fit.point.variance_by(factor)))
    spreads = INFLATION * sigma * np.sqrt(np.sum(reached**2, axis=0))
    levels = ndtri((np.arange(LEVELS) + 0.5) / LEVELS)
    gain, lag = at(centre)[:, None] + spreads[:, None] * levels
    return gain, lag


def _followed(
    one: KnownInput,
    fit: JointFit,
    posterior: JointPosterior,
    train: Sequence[Record],
    holdout: Sequence[Record],
    close_on: CloseOn,
) -> dict[str, object]:
    assert one.without is not None
    units = train[0].units
    unit = train[0].known_units.get(one.column, "")
    gain, lag = _drawn(posterior, one.column)
    estimates = {
        "gain": Estimate.of(gain, f"{units.output}/({unit})" if unit else ""),
        "lag_s": Estimate.of(lag, "s"),
    }
    closures = [close_on(records, one.without, fit) for records in (train, holdout)]
    calibration = JointCalibration.built_in()
    probability = calibration.sure(one.nats, calibration.floor)
    low, high = closures[1].closed_hdi94
    follows = f"The gap follows {one.column} ({100 * probability:.3g} % sure): it acts {WAYS[one.way]}"
    gone = f"{100 * closures[1].closed:.3g} % ({100 * low:.3g} to {100 * high:.3g} %)"
    helps = f", and with it {gone} of the avoidable error of what was held out is gone."
    sentence = follows + (helps if high > 0 else "; what was held out is not predicted better with it.")
    return {
        "follows": True,
        "probability": probability,
        "nats": one.nats,
        "way": one.way,
        "block": BLOCKS[one.way],
        **{name: estimate.to_dict() for name, estimate in estimates.items()},
        "gap": {"train": closures[0].to_dict(), "holdout": closures[1].to_dict()},
        "sentence": sentence,
    }
