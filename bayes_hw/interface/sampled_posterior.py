"""How sure are a model's parameters, and what will the axis do?"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bayes_hw.infer import prediction
from bayes_hw.infer.inference import Inference, Sampled, infer, said_of
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.start_state import start_of_prediction, started_as
from bayes_hw.infer.starting_point import NoiseKind
from bayes_hw.interface.arguments import generator, model_given, records_given, threads
from bayes_hw.interface.doors import entered, warn_of
from bayes_hw.interface.identified_axis import IdentifiedAxis
from bayes_hw.interface.notebook import table_with_words
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.phrases import rounded
from bayes_hw.posing import Origin, Start
from bayes_hw.python_words import in_python
from bayes_hw.record import Record
from bayes_hw.report.page.drawing import on_paper
from bayes_hw.report.posterior.figures_posterior import marginals_canvas
from bayes_hw.report.posterior.figures_prediction import overview_canvas
from bayes_hw.report.posterior.posterior_report import predicted_record_of
from bayes_hw.report.posterior.posterior_sections import marginals

if TYPE_CHECKING:
    from xarray import DataTree


@dataclass(frozen=True, eq=False)
class PredictedOutput:
    """94 % bands of one record's output; `prediction` holds the arrays."""

    prediction: prediction.Prediction

    def __repr__(self) -> str:
        record = self.prediction.record
        fit = f", fit {self.prediction.fit_percent:.1f} %" if record.has_output else ""
        return f"<PredictedOutput of {record.name!r}: {len(record)} samples{fit}>"

    def to_dataframe(self) -> pd.DataFrame:
        """One row a sample: the columns of `bayes-hw predict`."""
        return pd.DataFrame(self.prediction.columns())

    def plot(self) -> Figure:
        """Record, prediction and bands over time, with the residual below."""
        return on_paper(overview_canvas(predicted_record_of(self.prediction)))


@dataclass(frozen=True, eq=False)
class SampledPosterior:
    """The posterior of a model's parameters; `inference` holds chains, starts and residual tests."""

    inference: Inference
    records: tuple[Record, ...]

    @property
    def posterior(self) -> Posterior:
        """Draws, summaries and whether the sampling has converged."""
        return self.inference.posterior

    @property
    def converged(self) -> bool:
        """Nested R-hat below 1.01 and 400 effective samples of every parameter."""
        return self.posterior.converged

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader of the posterior must know, in words."""
        return said_of(self.inference)

    @cached_property
    def tree(self) -> DataTree:
        """The ArviZ tree: posterior, prior, sample_stats, observed and constant data."""
        return self.posterior.to_arviz(self.records)

    def __repr__(self) -> str:
        ensembles, steps, walkers, parameters = self.posterior.values.shape
        state = "converged" if self.converged else "NOT CONVERGED"
        return (
            f"<SampledPosterior of {self.posterior.axis.model.name!r}: {state}, {parameters} parameters, "
            f"{ensembles} ensembles of {walkers} walkers, {steps} steps, {len(self.records)} records>"
        )

    def __str__(self) -> str:
        """One line a parameter: mean, standard deviation, 94 % interval."""
        rows = []
        for name, row in self.to_dataframe().iterrows():
            at, spread, low, high = (
                rounded(row[key], row["sd"]) for key in ("mean", "sd", "hdi94_low", "hdi94_high")
            )
            rows.append(f"{name:26} {at:>12} +- {spread:<9} [{low}, {high}] {row['unit']}".rstrip())
        return "\n".join([repr(self)[1:-1], *rows, *self.warnings])

    def _repr_html_(self) -> str:
        return table_with_words(self.to_dataframe(), repr(self)[1:-1], self.warnings)

    def to_dataframe(self) -> pd.DataFrame:
        """One row a parameter, as in posterior.json; `hdi94_low` and `hdi94_high` bound the 94 % HDI."""
        rows = {name: asdict(summary) for name, summary in self.posterior.reported.items()}
        table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")
        bounds = np.array(table.pop("hdi94").tolist())
        table.insert(3, "hdi94_low", bounds[:, 0])
        table.insert(4, "hdi94_high", bounds[:, 1])
        return table

    def plot(self) -> Figure:
        """Prior and posterior of every parameter, with 94 % intervals."""
        return on_paper(marginals_canvas(marginals(self.posterior, self.posterior.names, {})))

    def predict(
        self, record: Record, *, seed: int = 1, start: Start = "auto", origin: Origin = "start"
    ) -> PredictedOutput:
        """94 % bands of this record's output, from where it begins, as `bayes-hw predict`.

        `start` and `origin` as for `sample`. Raises InputError on a rate or units that are not the model's.
        """
        with in_python():
            given = entered([record], model=self.posterior.axis.model, start=start, origin=origin)
            posterior = started_as(self.posterior, start_of_prediction(start, given.start))
            return PredictedOutput(prediction.predict(posterior, given.records[0], generator(seed)))

    def write(self, folder: Path | str) -> None:
        """posterior.nc and posterior.json, as `bayes-hw sample` writes them."""
        self.posterior.write(Path(folder), self.records)


def sample(
    model: HammersteinWiener | IdentifiedAxis | Path | str,
    records: Record | Sequence[Record],
    *,
    seed: int = 1,
    free: Sampled = "all",
    start: Start = "auto",
    origin: Origin = "start",
    accept: Collection[str] = (),
    noise: NoiseKind = "auto",
    settings: SamplerSettings | None = None,
    jobs: int | None = None,
) -> SampledPosterior:
    """The posterior of `model`'s free parameters given `records`; as `bayes-hw sample`.

    The `model` may be what `identify` returned, or the path of a model.json.

    `jobs` threads (all cores unless given) change no number. Angles count from where each record begins,
    unless `origin` is "absolute". With `start` "free" the initial state of every record is estimated, "rest"
    takes each to begin at rest, "auto" finds out; `accept` as for `identify`. What was done, and what a
    reader of the posterior must know, is warned of as BayesHWWarning. Raises InputError on arguments that are
    not what they should be, and on records that do not fit the model.
    """
    with in_python():
        nominal = model_given(model)
        given = entered(records_given(records), model=nominal, start=start, origin=origin, accept=accept)
        found = infer(
            nominal,
            given.records,
            generator(seed),
            free=free,
            start=given.start,
            noise=noise,
            settings=settings,
            jobs=threads(jobs),
        )
    sampled = SampledPosterior(found, given.records)
    warn_of(sampled.warnings)
    return sampled
