"""How sure are a model's parameters, and what will the axis do?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bayes_hw.infer import prediction
from bayes_hw.infer.inference import Inference, StartCondition, infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.starting_point import NoiseKind
from bayes_hw.interface.arguments import generator, model_given, records_given, threads
from bayes_hw.model.axis_parameters import FreeSet
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record
from bayes_hw.report.drawing import on_paper
from bayes_hw.report.figures_posterior import marginals_canvas
from bayes_hw.report.figures_prediction import overview_canvas
from bayes_hw.report.posterior_report import predicted_record_of
from bayes_hw.report.posterior_sections import marginals

if TYPE_CHECKING:
    from xarray import DataTree


@dataclass(frozen=True, eq=False)
class PredictedOutput:
    """94 % bands of one record's output; `prediction` holds the arrays."""

    prediction: prediction.Prediction

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

    @cached_property
    def tree(self) -> DataTree:
        """The ArviZ tree: posterior, prior, sample_stats, observed and constant data."""
        return self.posterior.to_arviz(self.records)

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

    def predict(self, record: Record, *, seed: int = 1) -> PredictedOutput:
        """94 % bands of this record's output. Raises InputError on a rate that is not the model's."""
        return PredictedOutput(prediction.predict(self.posterior, record, generator(seed)))

    def write(self, folder: Path | str) -> None:
        """posterior.nc and posterior.json, as `bayes-hw sample` writes them."""
        self.posterior.write(Path(folder), self.records)


def sample(
    model: HammersteinWiener,
    records: Record | Sequence[Record],
    *,
    seed: int = 1,
    free: FreeSet = "all",
    start: StartCondition = "rest",
    noise: NoiseKind = "normal",
    settings: SamplerSettings | None = None,
    jobs: int | None = None,
) -> SampledPosterior:
    """The posterior of `model`'s free parameters given `records`; as `bayes-hw sample`.

    `jobs` threads (all cores unless given) change no number. Raises InputError on arguments that are not
    what they should be, and on records that do not fit the model.
    """
    given = records_given(records)
    found = infer(
        model_given(model),
        given,
        generator(seed),
        free=free,
        start=start,
        noise=noise,
        settings=settings,
        jobs=threads(jobs),
    )
    return SampledPosterior(found, given)
