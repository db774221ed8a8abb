"""All that a controller designer is told: the axis, the loops, the uncertainty sets, the settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.control.allowance import CrossoverCurve, NotchRange, crossover_curves, notch_ranges
from bayes_hw.control.axis_draws import AxisDraws, EffectInLoop
from bayes_hw.control.controller import Controller
from bayes_hw.control.limit_cycles import CycleCheck, check_cycles
from bayes_hw.control.loop import Loop
from bayes_hw.control.loop_bands import LoopBands, loop_bands
from bayes_hw.control.margins import Margins, Requirements, loop_margins
from bayes_hw.control.noise_paths import noise_paths
from bayes_hw.control.plant_summary import PlantSummary, plant_summary
from bayes_hw.control.responses import DURATION_S, Response, TestSignals, responses
from bayes_hw.control.tuning import Structure, Tuning, tune
from bayes_hw.control.uncertainty import KINDS, UncertaintySet, robustness_peak, uncertainty_set
from bayes_hw.errors import InputError
from bayes_hw.infer.posterior import Posterior
from bayes_hw.progress import Progress
from bayes_hw.threads import one_blas_thread

LEAST_DRAWS = 100


@dataclass(frozen=True)
class DesignSettings:
    """How much is computed: draws for the margins, and as many fresh ones; draws for the search of settings
    and of crossovers; draws simulated in time. `share` is the share of draws that must keep `requirements`,
    and that the uncertainty sets cover. `tuned` are the structures that are tuned."""

    draws: int = 2000
    search_draws: int = 500
    simulated_draws: int = 300
    share: float = 0.95
    requirements: Requirements = field(default_factory=Requirements)
    tuned: tuple[Structure, ...] = ("PI",)


class Effects(Protocol):
    """What a corrected model holds beside its linear part; `words` say what it is and how sure."""

    @property
    def words(self) -> str: ...

    @property
    def answer(self) -> tuple[str, ...]: ...

    @property
    def simulated(self) -> bool: ...

    def loop_of(self, values: FloatArray) -> EffectInLoop:
        """Of draws (draws, parameters) of the posterior."""
        ...

    def nominal_loop(self) -> EffectInLoop:
        """Of the point estimate."""
        ...


@dataclass(frozen=True, eq=False)
class LoopReport:
    """One controller on the axis: margins over the draws and at the nominal axis, limit cycles, responses.

    `robustness_peaks` are the largest |W T| of the multiplicative sets of order 1, 2, 3, empty for a
    controller at another rate than the model's.
    """

    controller: Controller
    loop: Loop
    nominal_loop: Loop
    margins: Margins
    nominal_margins: Margins
    bands: LoopBands
    cycles: tuple[CycleCheck, ...]
    responses: tuple[Response, ...]
    robustness_peaks: tuple[float, ...]

    def met(self, requirements: Requirements) -> float:
        """Probability of keeping the margins."""
        return float(np.mean(self.margins.meets(requirements)))

    @property
    def probability_stable(self) -> float:
        return float(np.mean(self.margins.stable))


@dataclass(frozen=True, eq=False)
class Design:
    """What `bayes-hw design` finds. `loops` are those of the controllers given, then of the tuned ones;
    `values` (draws, parameters) are the parameter vectors behind `axis`."""

    posterior: Posterior
    settings: DesignSettings
    values: FloatArray
    nominal: AxisDraws
    axis: AxisDraws
    plant: PlantSummary
    notches: tuple[NotchRange, ...]
    crossovers: tuple[CrossoverCurve, ...]
    signals: TestSignals
    loops: tuple[LoopReport, ...]
    sets: tuple[UncertaintySet, ...]
    tunings: tuple[Tuning, ...]
    effects: Effects | None = None


def design(
    posterior: Posterior,
    controllers: Sequence[Controller],
    rng: np.random.Generator,
    *,
    settings: DesignSettings | None = None,
    progress: Progress | None = None,
    effects: Effects | None = None,
) -> Design:
    """Everything above for `controllers`; without any, for the settings that are tuned here.

    `effects` of a corrected model act in the simulations in time and nowhere else: margins are those of the
    linear part.

    The first controller is the template of the tuned ones: its rate, limits, filters and delay are kept.
    Raises InputError when the posterior holds too few draws, G has no integrator, or a rate does not fit.
    """
    settings = settings or DesignSettings()
    progress = progress or Progress(quiet=True)
    with one_blas_thread():
        return _design(posterior, controllers, rng, settings, progress, effects)


def _design(
    posterior: Posterior,
    controllers: Sequence[Controller],
    rng: np.random.Generator,
    settings: DesignSettings,
    progress: Progress,
    effects: Effects | None,
) -> Design:
    needed = 2 * settings.draws
    values = posterior.draws(needed, rng)
    if len(values) < 2 * LEAST_DRAWS:
        raise InputError(
            f"the posterior holds {len(values)} draws, {2 * LEAST_DRAWS} are needed; sample longer"
        )
    half = len(values) // 2
    axis = AxisDraws.of_posterior(posterior, values[:half])
    fresh = AxisDraws.of_posterior(posterior, values[half:])
    nominal = AxisDraws.nominal(posterior)
    if effects is not None:
        axis = replace(axis, effect=effects.loop_of(values[:half]))
        nominal = replace(nominal, effect=effects.nominal_loop())
    for controller in controllers:
        Loop(nominal, controller)
    with progress.stage("the axis"):
        plant = plant_summary(posterior, values[:half], axis, nominal)
        notches = notch_ranges(
            plant.mode_draws("frequency_hz"), plant.mode_draws("damping_ratio"), settings.share
        )
        few = axis.take(np.arange(min(settings.search_draws, half)))
        crossovers = crossover_curves(
            nominal, few, [n.notch for n in notches], settings.requirements, settings.share
        )
    with progress.stage("uncertainty sets"):
        sets = tuple(uncertainty_set(kind, nominal, axis, fresh, settings.share) for kind in KINDS)
    template = controllers[0] if controllers else Controller("template", axis.sample_rate_hz, 1.0)
    tunings = []
    for structure in settings.tuned:
        with progress.stage(f"tuning of the {structure}"):
            tunings.append(
                tune(structure, template, nominal, few, fresh, settings.requirements, settings.share)
            )
    signals = TestSignals.for_axis(nominal)
    tuned = [t.controller for tuning in tunings for t in (tuning.robust, tuning.point)]
    n_axis = len(posterior.axis.parameters)
    simulated = axis.take(np.arange(min(settings.simulated_draws, half)))
    own_noise = values[: simulated.count, n_axis:].T
    noise = noise_paths(own_noise[0], own_noise[1:], round(DURATION_S * axis.sample_rate_hz), rng)
    loops = []
    for controller in [*controllers, *tuned]:
        with progress.stage(f"loop of {controller.name}"):
            loop, nominal_loop = Loop(axis, controller), Loop(nominal, controller)
            peaks: tuple[float, ...] = ()
            if controller.ratio_to(axis.sample_rate_hz) == 1:
                peaks = tuple(robustness_peak(w, nominal_loop, sets[0].frequency_hz) for w in sets[0].weights)
            loops.append(
                LoopReport(
                    controller=controller,
                    loop=loop,
                    nominal_loop=nominal_loop,
                    margins=loop_margins(loop),
                    nominal_margins=loop_margins(nominal_loop),
                    bands=loop_bands(loop, nominal_loop),
                    cycles=check_cycles(loop, settings.simulated_draws),
                    responses=responses(simulated, nominal, controller, signals, noise),
                    robustness_peaks=peaks,
                )
            )
    return Design(
        posterior=posterior,
        settings=settings,
        values=values[:half],
        nominal=nominal,
        axis=axis,
        plant=plant,
        notches=notches,
        crossovers=crossovers,
        signals=signals,
        loops=tuple(loops),
        sets=sets,
        tunings=tuple(tunings),
        effects=effects,
    )
