"""Why do a simulator and records differ?"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bayes_hw.errors import InputError
from bayes_hw.gap import diagnosis
from bayes_hw.gap.answer.verdict import Verdict
from bayes_hw.gap.any_train import diagnose_around
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.joint import joint_diagnosis
from bayes_hw.gap.joint.joint_diagnosis import OWN_MODEL, JointDiagnosis
from bayes_hw.held_out import held_out_of
from bayes_hw.interface.arguments import generator, model_given, records_given, struck, threads
from bayes_hw.interface.doors import entered, warn_of
from bayes_hw.interface.identified_axis import IdentifiedAxis
from bayes_hw.interface.notebook import table_with_words
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.posing import Origin, Start
from bayes_hw.python_words import in_python
from bayes_hw.record import Record
from bayes_hw.report.diagnosis.figures_diagnosis import gap_canvas
from bayes_hw.report.page.drawing import on_paper
from bayes_hw.simulators.simulator_diagnosis import (
    CORRECTED,
    full_simulator,
    open_simulator,
    simulator_case,
)
from bayes_hw.simulators.simulator_file import SimulatorFile
from bayes_hw.time_budget import SEARCH_S


@dataclass(frozen=True, eq=False)
class GapDiagnosis:
    """What is missing from a simulator; `diagnosis` holds fits, decision and prediction, `simulator` the one
    in a file, where there is one."""

    diagnosis: diagnosis.Diagnosis | JointDiagnosis
    simulator: SimulatorFile | None = None

    @property
    def verdict(self) -> Verdict:
        """The content of verdict.json."""
        return self.diagnosis.verdict

    @property
    def answer(self) -> tuple[str, ...]:
        """Labels said to be present; () for no structural gap, ("other",) for one that no entry explains."""
        return self.verdict.answer

    def __str__(self) -> str:
        """The verdict in words."""
        return self.diagnosis.sentence()

    def __repr__(self) -> str:
        named = " and ".join(self.answer) or "no structural gap"
        return f"<GapDiagnosis of {self.diagnosis.name!r}: {named}>"

    def _repr_html_(self) -> str:
        return table_with_words(self.to_dataframe(), str(self), self.verdict.notes)

    def to_dataframe(self) -> pd.DataFrame:
        """One row a label, most probable first: `probability` that it is present, whether in the answer."""
        ordered = sorted(self.verdict.probability.items(), key=lambda item: -item[1])
        named = set(self.answer) or {"none"}
        rows = {label: (probability, label in named) for label, probability in ordered}
        return pd.DataFrame.from_dict(rows, orient="index", columns=["probability", "in_answer"]).rename_axis(
            "label"
        )

    def plot(self) -> Figure:
        """The first record held out: measured, predicted before and after, and both errors."""
        found = self.diagnosis
        noise = self.verdict.gap_holdout.noise_floor
        return on_paper(gap_canvas(found.holdout[0], found.before, found.after, found.low, found.high, noise))

    def write(self, folder: Path | str) -> None:
        """verdict.json, holdout_prediction.csv and corrected.json; of a function's none, of a simulator's
        file the folder corrected/ with that simulator and the effect in it."""
        self.diagnosis.write(Path(folder))
        if self.simulator is not None:
            assert isinstance(self.diagnosis, diagnosis.Diagnosis)
            rng = np.random.default_rng(CORRECTED_SEED)
            self.simulator.write_corrected(self.diagnosis, Path(folder) / CORRECTED, rng)


MODEL_FILES = (".json", ".mat")
"""Endings of a model's file; any other is a simulator's."""

MISSING = "holdout: is missing; give records to train on, and records held out, which are never fitted"

CORRECTED_SEED = 1
"""Of the choice of draws that a corrected simulator comes with."""


def diagnose(
    model: HammersteinWiener | IdentifiedAxis | Path | str | Record | Sequence[Record],
    train: Record | Sequence[Record] | None = None,
    holdout: Record | Sequence[Record] | None = None,
    *,
    seed: int = 1,
    jobs: int | None = None,
    without: str | Sequence[str] = (),
    start: Start = "auto",
    origin: Origin = "start",
    accept: Collection[str] = (),
    declaration: Path | str | None = None,
    within_s: float = SEARCH_S,
) -> GapDiagnosis:
    """Where `model` departs from `train`, which unmodelled effect is missing, how far the gap shrinks.

    Without a model, `diagnose(records, holdout)`, or `diagnose(records)`, which holds out the last record or
    its end: structure of G, effect and noise are inferred together; so they are where the model is what
    `identify` found in these very records. A `model` may be the path of a model.json, or of a MuJoCo model or
    an FMU, with the path of its `declaration` (beside it, with .toml, where not given); `write` then gives
    the simulator back with the effect in it.

    As `bayes-hw diagnose`: outputs of `holdout` only score the finished prediction; labels in `without` are
    struck from the catalogue. Angles count from where each record begins, unless `origin` is "absolute"; a
    record that begins in motion is cut to where it first rests, unless `start` is "rest". A record that is
    not what it is said to be, such as an "unrelated" one, is refused unless `accept` names that. A search
    that takes `within_s` seconds ends with what it has, and a note says so. What was done is warned of as
    BayesHWWarning. Raises InputError on arguments that are not what they should be, and on records that do
    not fit the model.
    """
    with in_python():
        rng, number, labels = generator(seed), threads(jobs), struck(without)
        if isinstance(model, Path | str) and Path(model).suffix.lower() not in MODEL_FILES:
            return _of_file(
                Path(model), declaration, train, holdout, rng, number, labels, origin, start, accept, within_s
            )
        if declaration is not None:
            raise InputError("declaration: goes with the path of a simulator's file")
        if holdout is None and not isinstance(model, HammersteinWiener | IdentifiedAxis | Path | str):
            own = records_given(model)
            held_out = [] if train is None else records_given(train, "holdout")
            return _of_records(own, held_out, rng, number, origin, start, accept, within_s)
        if train is None or holdout is None:
            raise InputError(MISSING)
        simulator = model_given(model)
        records, held_out = records_given(train, "train"), records_given(holdout, "holdout")
        if isinstance(model, IdentifiedAxis) and model.is_of(records):
            return _of_records(records, held_out, rng, number, origin, start, accept, within_s, (OWN_MODEL,))
        posing = Case.of_records(simulator.name, simulator, records, held_out)
        case, notes = posing.posed(origin=origin, start=start, accepted=accept)
        warn_of(notes)
        return GapDiagnosis(
            diagnose_around(case, rng, jobs=number, without=labels, start=start, within_s=within_s)
        )


def _of_records(
    records: Sequence[Record],
    holdout: Sequence[Record],
    rng: np.random.Generator,
    jobs: int,
    origin: Origin,
    start: Start,
    accept: Collection[str],
    within_s: float,
    notes: Sequence[str] = (),
) -> GapDiagnosis:
    """The diagnosis of records alone; where none is held out, a part of them is."""
    given = entered(records, holdout, origin=origin, start="rest", accept=accept)
    chosen = held_out_of(given.records, given.holdout, start, origin)
    warn_of(chosen.notes)
    found = joint_diagnosis.diagnose_records(
        chosen.train, chosen.holdout, rng, name=records[0].name, lead=chosen.lead, start=start, jobs=jobs,
        within_s=within_s, notes=(*chosen.notes, *notes),
    )  # fmt: skip
    return GapDiagnosis(found)


def _of_file(
    path: Path,
    declaration: Path | str | None,
    train: Record | Sequence[Record] | None,
    holdout: Record | Sequence[Record] | None,
    rng: np.random.Generator,
    jobs: int,
    labels: frozenset[str],
    origin: Origin,
    start: Start,
    accept: Collection[str],
    within_s: float,
) -> GapDiagnosis:
    """The diagnosis of a simulator in a file."""
    if train is None or holdout is None:
        raise InputError(MISSING)
    records, held_out = records_given(train, "train"), records_given(holdout, "holdout")
    axis = open_simulator(path, None if declaration is None else Path(declaration), jobs)
    case, notes = simulator_case(axis, records, held_out, origin=origin, start=start, accepted=accept)
    warn_of(notes)
    full = full_simulator(axis, jobs)
    found = diagnosis.diagnose(case, rng, jobs=jobs, without=labels, full=full, within_s=within_s)
    return GapDiagnosis(found, axis)
