"""A fit in observer form: its states are corrected at every sample by what the encoder shows.

Where motion is chaotic (a load that bounces in its gear), two simulations that hardly differ part within the
record, and the likelihood of a simulation has no slope. With x(k+1) = A x + B v + P torque + L (y - yhat)
what is left are errors of prediction by one sample, whose likelihood is smooth (Ljung, System Identification,
2nd ed., secs. 4.3 and 7.4). The innovation y - yhat is a torque like others: L are the weights of its port,
free in the descent. They begin at the gain of the stationary Kalman filter of G driven by white torques
through the ports of the laws (Anderson and Moore, Optimal Filtering, 1979, sec. 4.4).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError, block_diag, solve_discrete_are

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.structure_moves import regrown
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import INNOVATION_COLUMN, Form
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.cascade import CascadeValues
from bayes_hw.identify.cascade_roots import section_poles
from bayes_hw.identify.holes import with_holes

OBSERVER = Form(
    "observer", "", "law", lambda _: (), lambda _: [()], K.INNOVATION, K.BASE_COMMAND, INNOVATION_COLUMN
)

AHEAD_EXPLAINED = 0.5
"""Of what an explanation without laws leaves a cycle ahead, that laws must take away to follow the axis."""

SHARES = (0.03, 0.1, 0.3, 1.0)
"""Of the root mean square of a law's torque, taken for the standard deviation of the white one."""

GAINS_TRIED = 2
SMALLEST_PART = 1e-6
"""Of the variance that the torques give all states together, which every state has at least."""


def kalman_gain(cascade: CascadeValues, torques: FloatArray, sigma: float) -> FloatArray | None:
    """Gain (states,) of the stationary filter of G's poles and sections, without its integrator, driven by
    white noise with the columns of `torques` (states, n) and read with noise `sigma`.

    States are the real poles' and both of every section in turn. None where the filter does not settle.
    """
    pairs = [np.array([[a1, 1.0], [-a2, 0.0]]) for a1, a2 in cascade.sections[:2].T]
    transition = block_diag(*([np.diag(cascade.real[0])] if cascade.real.size else []), *pairs)
    shown = np.concatenate([np.ones(cascade.real.shape[1]), np.tile([1.0, 0.0], len(pairs))])
    spread = torques @ torques.T
    spread += SMALLEST_PART * float(np.trace(spread)) * np.eye(len(shown))
    try:
        variance = solve_discrete_are(transition.T, shown[:, None], spread, np.array([[sigma**2]]))
    except (LinAlgError, ValueError):
        return None
    found = transition @ variance @ shown / (float(shown @ variance @ shown) + sigma**2)
    return np.asarray(found) if np.isfinite(found).all() else None


def observed(fit: JointFit) -> list[JointFit]:
    """The fit in observer form with the best two of some gains to begin with, not descended; none where it
    has no law, or is in that form."""
    values, order = fit.values, fit.structure.real_poles + fit.structure.sections
    laws = [e for e in values.effects if e.is_own_law]
    if fit.observer is not None or not laws or not order:
        return []
    runs = [fit.response.along(values, number) for number in range(len(fit.response.records))]
    own = [e.is_own_law for e in values.effects if e.ports is not None]
    torques = np.concatenate([run.torques for run in runs], axis=1)[np.array(own)]
    sizes = np.sqrt(np.mean(torques**2, axis=1))
    entering = np.stack([np.concatenate([e.ports.real, e.ports.sections.T.ravel()]) for e in laws], axis=1)  # type: ignore[union-attr]
    found = []
    for share in SHARES:
        gain = kalman_gain(values.cascade, share * sizes * entering, fit.innovation_sigma)
        if gain is not None:
            found.append(_with_gain(fit, gain))
    return sorted(found, key=lambda fit: -fit.score)[:GAINS_TRIED]


def _with_gain(fit: JointFit, gain: FloatArray) -> JointFit:
    """In observer form with a gain (states,)."""
    larger = fit.with_known(OBSERVER, ())
    effects = list(larger.values.effects)
    number, poles = larger.known_count - 1, fit.structure.real_poles
    ports = effects[number].ports
    assert ports is not None
    sections = np.ascontiguousarray(gain[poles:].reshape(-1, 2).T)
    effects[number] = replace(effects[number], ports=replace(ports, real=gain[:poles], sections=sections))
    return larger.moved(larger.structure, JointValues(larger.values.cascade, tuple(effects)))


def unobserved(fit: JointFit) -> tuple[JointFit, IntArray]:
    """The fit as a simulation that no reading corrects, not descended, and which of its coordinates (n,) it
    keeps."""
    if fit.observer is None:
        return fit, np.arange(fit.response.size)
    begin = fit.response.size - sum(fit.response.effect_sizes[fit.observer :])
    end = begin + fit.response.effect_sizes[fit.observer]
    kept = np.concatenate([np.arange(begin), np.arange(end, fit.response.size)])
    return fit.without_observer(), kept


def follows_a_cycle(fit: JointFit) -> bool:
    """Whether the laws of a fit in observer form follow the axis from where readings have corrected it for a
    cycle of G's slowest motion: where motion is chaotic no simulation does for longer."""
    if fit.observer is None or not fit.effect_labels:
        return False
    bare = regrown(fit.without_labels())
    sections = fit.values.cascade.sections
    angles = [abs(np.angle(section_poles(a1, a2)[0])) for a1, a2 in sections[:2].T]
    slowest = min((angle for angle in angles if angle > 0), default=np.pi)
    samples = max(round(2 * np.pi / slowest), 2)
    noise = fit.innovation_sigma**2
    return errors_ahead(fit, samples) - noise < (1 - AHEAD_EXPLAINED) * (errors_ahead(bare, samples) - noise)


def errors_ahead(fit: JointFit, samples: int) -> float:
    """Mean square of the weighted errors in stretches of so many samples that no reading corrects, each after
    twice as many that readings do."""
    errors = []
    for number, (record, level) in enumerate(zip(fit.response.records, fit.levels, strict=True)):
        weights = 1.0 if fit.response.weights is None else fit.response.weights[number]
        told = fit.response.measured(number)
        at = np.arange(len(record)) // samples
        for turn in range(3):
            free = at % 3 == turn
            run = fit.response.corrected_where(fit.values, number, ~free)
            errors.append(with_holes((record.y - level - run.y) / weights, told)[free])
    return float(np.nanmean(np.concatenate(errors) ** 2))
