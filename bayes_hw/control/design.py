"""All that a controller designer is told: the axis, the loops, the uncertainty sets, the settings."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy import signal

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.control.allowance import CrossoverCurve, NotchRange, crossover_curves, notch_ranges
from bayes_hw.control.axis_draws import AxisDraws, EffectInLoop
from bayes_hw.control.controller import Controller
from bayes_hw.control.limit_cycles import CycleCheck, check_cycles
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Margins, Requirements, loop_margins
from bayes_hw.control.plant_summary import PlantSummary, plant_summary
from bayes_hw.control.responses import DURATION_S, Response, TestSignals, responses
from bayes_hw.control.tuning import Structure, Tuning, tune
from bayes_hw.control.uncertainty import KINDS, UncertaintySet, robustness_peak, uncertainty_set
from bayes_hw.errors import InputError
from bayes_hw.identify.noise import autoregression_from_partial
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.progress import Progress
from bayes_hw.threads import one_blas_thread

BURN_IN = 500


def noise_paths(sigma: FloatArray, partial: FloatArray, samples: int, rng: np.random.Generator) -> FloatArray:
    """One path (draws, samples) of e(k) = sum_i phi_i e(k - i) + a(k) a draw.

    `sigma` (draws,) is the marginal standard deviation in output units, `partial` (p, draws) are the partial
    autocorrelations.
    """
    innovation = sigma * np.sqrt(np.prod(1 - partial**2, axis=0))
    shocks = innovation[:, None] * rng.standard_normal((len(sigma), BURN_IN + samples))
    coefficients = autoregression_from_partial(partial)
    paths = [
        signal.lfilter([1.0], np.concatenate([[1.0], -phi]), row)[BURN_IN:]
        for phi, row in zip(coefficients.T, shocks, strict=True)
    ]
    return np.asarray(paths, dtype=np.float64)


CURVES = 24
"""Draws whose Nyquist curves are kept."""

BAND_DRAWS = 500


@dataclass(frozen=True, eq=False)
class LoopBands:
    """S = 1 / (1 + L) and T = L / (1 + L) in dB: pointwise central 94 % (2, frequencies) and that of the
    point estimate (frequencies,); L of some draws (curves, frequencies) and of the point estimate."""

    frequency_hz: FloatArray
    sensitivity_db: FloatArray
    nominal_sensitivity_db: FloatArray
    complementary_db: FloatArray
    nominal_complementary_db: FloatArray
    curves: ComplexArray
    nominal_curve: ComplexArray


def loop_bands(loop: Loop, nominal: Loop) -> LoopBands:
    """Bands of the first BAND_DRAWS draws of `loop`."""
    frequency = loop.frequency_hz
    few = Loop(loop.axis.take(np.arange(min(BAND_DRAWS, loop.axis.count))), loop.controller)
    response, centre = few.response(frequency), nominal.response(frequency)[0]
    tails = [(1 - INTERVAL_PROBABILITY) / 2, (1 + INTERVAL_PROBABILITY) / 2]

    def band(values: ComplexArray) -> FloatArray:
        return np.asarray(20 * np.log10(np.quantile(np.abs(values), tails, axis=0)), dtype=np.float64)

    def decibel(values: ComplexArray) -> FloatArray:
        return np.asarray(20 * np.log10(np.abs(values)), dtype=np.float64)

    return LoopBands(
        frequency,
        band(1 / (1 + response)),
        decibel(1 / (1 + centre)),
        band(response / (1 + response)),
        decibel(centre / (1 + centre)),
        response[:CURVES],
        centre,
    )


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
    jobs: int = 1,
    progress: Progress | None = None,
    effects: Effects | None = None,
) -> Design:
    """Everything above for `controllers`; without any, for the settings that are tuned here.

    `effects` of a corrected model act in the simulations in time and nowhere else: margins are those of the
    linear part.

    The first controller is the template of the tuned ones: its rate, limits, filters and delay are kept.
    Parts that do not wait for each other run in `jobs` threads; the numbers do not depend on it. Raises
    InputError when the posterior holds too few draws, G has no integrator, or a rate does not fit.
    """
    settings = settings or DesignSettings()
    progress = progress or Progress(quiet=True)
    with one_blas_thread(), ThreadPoolExecutor(max(jobs, 1)) as pool:
        return _design(posterior, controllers, rng, settings, pool, progress, effects)


def _design(
    posterior: Posterior,
    controllers: Sequence[Controller],
    rng: np.random.Generator,
    settings: DesignSettings,
    pool: ThreadPoolExecutor,
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
    few = axis.take(np.arange(min(settings.search_draws, half)))
    template = controllers[0] if controllers else Controller("template", axis.sample_rate_hz, 1.0)
    asked, share = settings.requirements, settings.share
    with progress.stage("the axis, uncertainty sets, tuning"):
        tuning_parts = [
            pool.submit(tune, structure, template, nominal, few, fresh, asked, share)
            for structure in settings.tuned
        ]
        plant = plant_summary(posterior, values[:half], axis, nominal)
        notches = notch_ranges(plant.mode_draws("frequency_hz"), plant.mode_draws("damping_ratio"), share)
        crossover_part = pool.submit(crossover_curves, nominal, few, [n.notch for n in notches], asked, share)
        set_parts = [pool.submit(uncertainty_set, kind, nominal, axis, fresh, share) for kind in KINDS]
        tunings = [part.result() for part in tuning_parts]
        crossovers = crossover_part.result()
        sets = tuple(part.result() for part in set_parts)
    signals = TestSignals.for_axis(nominal)
    tuned = [t.controller for tuning in tunings for t in (tuning.robust, tuning.point)]
    n_axis = len(posterior.axis.parameters)
    simulated = axis.take(np.arange(min(settings.simulated_draws, half)))
    own_noise = values[: simulated.count, n_axis:].T
    noise = noise_paths(own_noise[0], own_noise[1:], round(DURATION_S * axis.sample_rate_hz), rng)

    def reported(controller: Controller) -> LoopReport:
        loop, nominal_loop = Loop(axis, controller), Loop(nominal, controller)
        peaks: tuple[float, ...] = ()
        if controller.ratio_to(axis.sample_rate_hz) == 1:
            peaks = tuple(robustness_peak(w, nominal_loop, sets[0].frequency_hz) for w in sets[0].weights)
        return LoopReport(
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

    with progress.stage(f"{len(controllers) + len(tuned)} loops"):
        loops = list(pool.map(reported, [*controllers, *tuned]))
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
