"""The whole question for one axis: what can its records tell, and what can they not?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.identifiability.asymmetry import AssumptionTest, check_assumptions
from bayes_hw.identifiability.freed_gains import ASYMMETRIES, with_unit_slopes
from bayes_hw.identifiability.gain_posterior import FreedRuns, implied_log_sd, sample_freed
from bayes_hw.identifiability.invariance import Agreement, Contraction, compare_invariants, contractions
from bayes_hw.identifiability.prior_sensitivity import power_scaling
from bayes_hw.identifiability.profile import Profile, profile_likelihoods
from bayes_hw.identifiability.sensitivity import Spectrum, information_spectrum
from bayes_hw.identifiability.structure import (
    POINTS,
    Cancellation,
    Structure,
    analyse_structure,
    near_cancellations,
)
from bayes_hw.identifiability.verdict import RULES, ParameterVerdict, flat_verdicts, verdict_on
from bayes_hw.identify.output_error import fit_output_error, prior_scale
from bayes_hw.infer.dead_zone_trade import Trade, trade_of
from bayes_hw.infer.inference import Inference, StartCondition, axis_for, infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.starting_point import covariance_with_prior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import as_values
from bayes_hw.progress import Progress
from bayes_hw.record import Record

SCHEMA = "bayes-hw/identifiability/1"
KEPT_DRAWS = 4_000
TRADE_DRAWS = 2_000


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What was found for one axis.

    `inference` is the paper's run, c1 = c2 = c3 = 1 and equal thresholds; `freed` has all of them free,
    `chart` only c3 and the negative threshold (c1 = c2 = 1). `trade` is what trades places with the dead
    zone where every root of G is free.
    """

    title: str
    inference: Inference
    structure: Structure
    freed: Posterior
    chart: Posterior
    agreement: Agreement
    raw_contractions: tuple[Contraction, ...]
    invariant_contractions: tuple[Contraction, ...]
    assumptions: tuple[AssumptionTest, ...]
    spectra: tuple[Spectrum, ...]
    profiles: tuple[Profile, ...]
    verdicts: tuple[ParameterVerdict, ...]
    flat: tuple[ParameterVerdict, ...]
    cancellations: tuple[Cancellation, ...]
    trade: Trade | None = None

    @property
    def converged(self) -> bool:
        """Whether all three runs have."""
        return all(run.converged for run in (self.inference.posterior, self.freed, self.chart))

    def to_dict(self) -> dict[str, Any]:
        """The content of identifiability.json."""
        return {
            "schema": SCHEMA,
            "verdicts": {verdict.name: verdict.to_dict() for verdict in self.verdicts},
            "with_gains_free": {verdict.name: verdict.to_dict() for verdict in self.flat},
            "rules": list(RULES),
            "structure": self.structure.to_dict(),
            "invariants": self.agreement.to_dict(),
            "contraction": {
                each.name: {
                    "contraction": each.contraction,
                    "by_pooling_of_priors": each.by_pooling,
                    "prior_log_sd": each.prior_log_sd,
                    "posterior_log_sd": each.posterior_log_sd,
                }
                for each in (*self.raw_contractions, *self.invariant_contractions)
            },
            "assumptions": {test.name: test.to_dict() for test in self.assumptions},
            "spectra": [spectrum.to_dict() for spectrum in self.spectra],
            "profiles": {profile.name: profile.to_dict() for profile in self.profiles},
            "near_cancellations": [each.to_dict() for each in self.cancellations],
            "posteriors": {
                "paper": self.inference.posterior.to_dict(),
                "freed": self.freed.to_dict(),
                "normalized": self.chart.to_dict(),
            },
            "dead_zone_trade": None if self.trade is None else self.trade.to_dict(),
            "converged": self.converged,
        }

    def write(self, folder: Path) -> None:
        """identifiability.json, and freed_draws.csv with draws of the run that has all gains free."""
        content = self.to_dict()
        flat = self.freed.values.reshape(-1, self.freed.values.shape[-1])
        kept = flat[:: -(-len(flat) // KEPT_DRAWS)]
        with staged(folder) as place:
            write_json(place / "identifiability.json", content)
            write_csv(place / "freed_draws.csv", dict(zip(self.freed.names, kept.T, strict=True)))


def analyse_identifiability(
    title: str,
    model: HammersteinWiener,
    records: Sequence[Record],
    rng: np.random.Generator,
    *,
    start: StartCondition = "rest",
    settings: SamplerSettings | None = None,
    jobs: int = 1,
    points: int = POINTS,
    progress: Progress | None = None,
) -> Identifiability:
    """Structure, posteriors with and without the gains free, and the practical verdicts.

    The model is put into the chart c1 = c2 = 1 first, which changes no output.
    """
    progress = progress or Progress(quiet=True)
    model = with_unit_slopes(model)
    structure_rng, infer_rng, freed_rng = rng.spawn(3)
    inference = infer(
        model,
        records,
        infer_rng,
        free="conditional",
        start=start,
        settings=settings,
        jobs=jobs,
        progress=progress,
    )
    with progress.stage("flat directions"):
        structure = analyse_structure(model, structure_rng, points=points)
    runs = sample_freed(inference, records, freed_rng, settings=settings, jobs=jobs, progress=progress)
    with progress.stage("profile likelihoods and spectra"):
        profiles = _profiles(inference, runs, records)
        spectra = _spectra(inference, runs, records)
        trade = _trade(inference, records, start, structure_rng)
    raw, kept = contractions(runs.freed)
    return Identifiability(
        title=title,
        inference=inference,
        structure=structure,
        freed=runs.freed,
        chart=runs.chart,
        agreement=compare_invariants(runs.freed, runs.chart),
        raw_contractions=raw,
        invariant_contractions=kept,
        assumptions=check_assumptions(runs.freed),
        spectra=spectra,
        profiles=profiles,
        verdicts=_verdicts(inference, runs, profiles, records),
        flat=flat_verdicts(
            structure.names, dict(zip(structure.names, structure.flat_share.tolist(), strict=True))
        ),
        cancellations=near_cancellations(model),
        trade=trade,
    )


def _trade(
    inference: Inference, records: Sequence[Record], start: StartCondition, rng: np.random.Generator
) -> Trade | None:
    """From the Gauss-Newton covariance about the posterior mean, all roots of G free."""
    noise = inference.start.noise
    axis = axis_for(inference.posterior.mean_model(), records, "all", start)
    fit = fit_output_error(
        axis,
        records,
        axis.nominal,
        autoregression=noise.autoregression,
        sigma=noise.innovation_sigma,
        prior=True,
    )
    covariance = covariance_with_prior(fit.information, prior_scale(axis)[1])
    draws = rng.multivariate_normal(fit.coordinates, covariance, size=TRADE_DRAWS, method="cholesky")
    return trade_of(axis, as_values(axis.parameters, draws.T).T, records)


def _axis_values(posterior: Posterior) -> FloatArray:
    return posterior.point_estimate[: len(posterior.axis.parameters)]


def _profiles(inference: Inference, runs: FreedRuns, records: Sequence[Record]) -> tuple[Profile, ...]:
    """Those of the paper's parameters, and of c3 and the negative threshold in the chart c1 = c2 = 1."""
    found: list[Profile] = []
    for posterior, noise, names in (
        (inference.posterior, inference.start.noise, None),
        (runs.chart, runs.noise, ASYMMETRIES),
    ):
        found += profile_likelihoods(
            posterior.axis,
            _axis_values(posterior),
            records,
            noise.autoregression,
            noise.innovation_sigma,
            names,
        )
    return tuple(found)


def _spectra(inference: Inference, runs: FreedRuns, records: Sequence[Record]) -> tuple[Spectrum, ...]:
    chosen = (
        ("all gains free", runs.freed, runs.noise),
        ("c₁ = c₂ = 1", runs.chart, runs.noise),
        ("paper: c₁ = c₂ = c₃ = 1, δ₋\u00a0=\u00a0δ₊", inference.posterior, inference.start.noise),
    )
    return tuple(
        information_spectrum(
            label, run.axis, _axis_values(run), records, noise.autoregression, noise.innovation_sigma
        )
        for label, run, noise in chosen
    )


def _verdicts(
    inference: Inference, runs: FreedRuns, profiles: Sequence[Profile], records: Sequence[Record]
) -> tuple[ParameterVerdict, ...]:
    posterior = inference.posterior
    profile_of = {profile.name: profile for profile in profiles}
    scaling = power_scaling(
        posterior, LogPosterior(posterior.axis, posterior.noise_parameters, records, posterior.power)
    )
    verdicts = [
        verdict_on(name, contraction, profile_of.get(name), scaling.get(name))
        for name, contraction in posterior.contraction.items()
        if not name.startswith("start")
    ]
    for name in ASYMMETRIES:
        spread = float(np.std(np.log(runs.chart.chains(name))))
        prior = implied_log_sd(name, runs.freed.axis.parameters)
        verdicts.append(verdict_on(name, 1 - (spread / prior) ** 2, profile_of[name]))
    return tuple(verdicts)
