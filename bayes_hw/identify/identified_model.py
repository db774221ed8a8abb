"""From a fitted cascade to the models that users read, and to words about what the records show."""

from __future__ import annotations

import numpy as np

from bayes_hw.identify.cascade_fit import CascadeFit
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.identify.criterion import DECISIVE
from bayes_hw.identify.experiment import Experiment
from bayes_hw.identify.resonances import dominant_modes
from bayes_hw.identify.result import Cascade, LinearModel, Shown
from bayes_hw.identify.whole_cascade import JointStage
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.phrases import in_percent
from bayes_hw.record import Units

WEAK_INTEGRATOR = 0.5
"""Below this share of the output's spread an integrator looks like drift rather than like an axis."""


def cascade_in_units(experiment: Experiment, fit: CascadeFit) -> Cascade:
    """The fitted cascade in the units of the records."""
    return Cascade(fit.structure, experiment.in_original_units(fit.values))


def baseline_model(experiment: Experiment, fit: CascadeFit) -> LinearModel:
    """The linear baseline in the units of the records."""
    values = experiment.in_original_units(fit.values)
    return LinearModel(linear_block(fit.structure, values), values.input_offset)


def hammerstein_wiener_model(
    experiment: Experiment, fit: CascadeFit, sigma: float, name: str, units: Units
) -> HammersteinWiener:
    """The cascade as a model; a limit that it lacks is put at the largest command seen on its side."""
    values, structure = experiment.in_original_units(fit.values), fit.structure
    lowest, highest = extreme_commands(experiment)
    linear = linear_block(structure, values)
    return HammersteinWiener(
        name=name,
        sample_rate_hz=experiment.sample_rate_hz,
        saturation=Saturation(
            values.lower if structure.lower else lowest, values.upper if structure.upper else highest
        ),
        linear=linear,
        dead_zone=DeadZone(values.half_width),
        dominant_modes=dominant_modes(
            structure,
            values,
            experiment.sample_rate_hz,
            max(record.duration_s for record in experiment.records),
        ),
        noise_sigma=sigma,
        units=units,
    )


def extreme_commands(experiment: Experiment) -> tuple[float, float]:
    """The largest commands below and above zero; where a side has none, the other side's mirrored."""
    commands = np.concatenate(experiment.commands) * experiment.input_scale
    lowest, highest = float(commands.min()), float(commands.max())
    return (lowest if lowest < 0 else -highest, highest if highest > 0 else -lowest)


def blocks_shown(experiment: Experiment, joint: JointStage, units: Units) -> dict[str, Shown]:
    """For every static block, whether leaving it out is decisively worse, in words."""
    values = experiment.in_original_units(joint.fit.values)
    commands = np.concatenate(experiment.commands) * experiment.input_scale
    outputs = np.concatenate(experiment.outputs) * experiment.output_scale
    inside = float(np.mean(np.abs(outputs) <= values.half_width))
    nearest = float(np.abs(outputs).min())
    facts = {
        "lower": (
            f"{in_percent(float(np.mean(commands < values.lower)))} of the commands lie below it",
            f"no command lies below {commands.min():.4g} {units.input}",
        ),
        "upper": (
            f"{in_percent(float(np.mean(commands > values.upper)))} of the commands lie above it",
            f"no command lies above {commands.max():.4g} {units.input}",
        ),
        "dead_zone": (
            f"{in_percent(inside)} of the outputs lie within its half width of zero",
            f"the smallest |y| is {nearest:.3g} {units.output}",
        ),
    }
    names = {"lower": "saturation.lower", "upper": "saturation.upper", "dead_zone": "dead_zone"}
    return {
        names[block]: _shown(experiment, joint, block, present, absent)
        for block, (present, absent) in facts.items()
    }


def integrator_share(experiment: Experiment, fit: CascadeFit) -> float:
    """Spread of the integrator's part of w over the spread of y, all records together; about 1 for a
    position."""
    values = fit.values
    parts = [
        values.integrator_residue * np.cumsum(np.clip(u, values.lower, values.upper))
        for u in experiment.commands
    ]
    return float(np.std(np.concatenate(parts)) / np.std(np.concatenate(experiment.outputs)))


def warnings_of(
    experiment: Experiment, joint: JointStage, linear: CascadeFit, shown: dict[str, Shown]
) -> tuple[str, ...]:
    """Sentences that a reader of the estimate must see."""
    found = [
        f"{name} is not shown by these records: {block.reason}"
        for name, block in shown.items()
        if not block.shown
    ]
    if linear.sum_of_squares <= joint.fit.sum_of_squares:
        found.append(
            "the linear baseline, which has a constant command offset besides, describes these records "
            "at least as well"
        )
    if joint.kept.slow:
        found.append(
            f"{joint.kept.slow} slow real poles of G are kept although the records do not ask for "
            "them: they would lose travel at each reversal as a dead zone does, and the interval of the dead "
            "zone must allow for them"
        )
    if not joint.fit.structure.integrator:
        found.append("the records speak against an integrator; the output does not behave like a position")
    elif (share := integrator_share(experiment, joint.fit)) < WEAK_INTEGRATOR:
        found.append(
            f"the integrator carries only {in_percent(share)} of the output's spread; "
            "the output may not be a position"
        )
    return tuple(found)


def search_note(factor: int, searched: int, samples: int) -> tuple[str, ...]:
    """A sentence saying so when the structure was sought on less than the records as given."""
    if searched == samples:
        return ()
    rate = f"at a rate lower by {factor}" if factor > 1 else "on the beginnings of the records"
    return (
        f"order and blocks were sought {rate} ({searched} samples), since the records are long; every number "
        f"was then fitted to all {samples} samples",
    )


def _shown(experiment: Experiment, joint: JointStage, block: str, present: str, absent: str) -> Shown:
    rise = joint.evidence[block]
    if rise is None:
        return Shown(False, f"{absent}, which leaves nothing to estimate it from")
    without = joint.rms_without[block] * experiment.output_scale
    change = (
        f"leaving it out changes the criterion by {rise:.0f} (bound {DECISIVE:g}) "
        f"and the rms output error to {without:.4g}"
    )
    if getattr(joint.fit.structure, block):
        return Shown(True, f"{present}; {change}")
    return Shown(False, f"{absent}; {change}")
