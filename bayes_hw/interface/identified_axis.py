"""Which model fits these records?"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from bayes_hw.entrance import share_samples
from bayes_hw.gap.joint.answer.known_model import with_known
from bayes_hw.identify import four_steps
from bayes_hw.identify.result import Identification
from bayes_hw.infer.inference import StartCondition, axis_for
from bayes_hw.interface.arguments import generator, records_given
from bayes_hw.interface.doors import entered, warn_of
from bayes_hw.interface.notebook import table_with_words
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Origin, Start
from bayes_hw.python_words import in_python
from bayes_hw.record import Record
from bayes_hw.report.page.drawing import on_paper
from bayes_hw.report.posterior.figures_prediction import fit_canvas


@dataclass(frozen=True, eq=False)
class IdentifiedAxis:
    """A model with its records; `identification` holds all that the four steps found."""

    identification: Identification
    records: tuple[Record, ...]
    start: StartCondition

    @property
    def model(self) -> HammersteinWiener:
        """The estimate, as `model.write("model.json")` stores it; `sample` and `diagnose` take the whole."""
        return self.identification.model

    def is_of(self, records: Sequence[Record]) -> bool:
        """Whether any of these records is one that it was identified from, wherever its angles count from."""
        return any(
            share_samples(one.counted_from(own.origin - one.origin), own)
            for own in self.records
            for one in records
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader of the estimate must know, in words."""
        return self.identification.warnings

    def __repr__(self) -> str:
        fits = ", ".join(
            f"{fit.hammerstein_wiener:.2f} % of {fit.record}" for fit in self.identification.fits
        )
        doubts = f"; {len(self.warnings)} warnings" if self.warnings else ""
        return f"<IdentifiedAxis: {self.model!r} explains {fits}{doubts}>"

    def _repr_html_(self) -> str:
        return table_with_words(self.to_dataframe(), repr(self)[1:-1], self.warnings)

    def to_dataframe(self) -> pd.DataFrame:
        """One row a parameter, named as in posterior.json: `value` and `unit`."""
        parameters = axis_for(self.model, self.records, "conditional", "rest").parameters
        rows = {p.name: (p.nominal, p.unit) for p in parameters}
        rows["noise.sigma"] = (self.model.noise_sigma, self.model.units.output)
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "unit"]).rename_axis(
            "parameter"
        )

    def plot(self, record: int = 0) -> Figure:
        """The record of this index, what the model simulates of it, and the difference; no bands."""
        shown = self.records[record]
        return on_paper(fit_canvas(shown, shown.y - self.identification.residuals[record]))


def identify(
    records: Record | Sequence[Record],
    *,
    seed: int = 1,
    name: str | None = None,
    start: Start = "auto",
    origin: Origin = "start",
    accept: Collection[str] = (),
) -> IdentifiedAxis:
    """The four-step estimate from `records` of one axis; as `bayes-hw identify`.

    `name` is the model's (the first record's unless given). Angles count from where each record begins,
    unless `origin` is "absolute". With `start` "free" the initial state of every record is estimated, "rest"
    takes each to begin at rest, "auto" finds out. Known inputs of the records that the angle follows become
    part of the model. A record that is not what it is said to be, such as an "unrelated" one, is refused
    unless `accept` names that. What was done, and what a reader of the estimate must know,
    is warned of as BayesHWWarning. `seed` is taken as in `sample` and `diagnose`, so that all three are
    called alike; the estimate draws no random numbers. Raises InputError when the arguments are not what they
    should be, or the records cannot be used.
    """
    with in_python():
        given = entered(records_given(records), start=start, origin=origin, accept=accept)
        generator(seed)
        found = four_steps.identify(
            given.records,
            name=name or given.records[0].name,
            free_start=given.start == "free",
        )
        found = with_known(found, given.records)
    warn_of(found.warnings)
    return IdentifiedAxis(found, given.records, given.start)
