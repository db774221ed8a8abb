"""Known inputs of the records: whether the gap follows a further measured column, which way, and how far.

A column acts through the load, as a torque that reaches the angle by the poles of G at weights of its own, or
at the encoder, as a part of the reading. Whichever the evidence prefers becomes part of the cascade before
any effect of the catalogue is looked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.joint.fit.joint_fit import JointFit, highest
from bayes_hw.gap.joint.fit.structure_moves import pruned, regrown
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale, Slot
from bayes_hw.gap.joint.search.effect_moves import FIRST_STEPS
from bayes_hw.gap.joint.search.effect_screen import best_starts, screened
from bayes_hw.model.known_input import READING, TORQUE
from bayes_hw.record import Record

LABEL = "known:"
BLOCKS: Mapping[str, str] = {TORQUE: "disturbance", READING: "sensor"}

LAGS_S = (0.0, 0.1, 0.3, 1.0, 3.0)
EARLIEST_S, LATEST_S = 1.0, 10.0
"""How far a column may be stamped late, and how late it may act."""

ASKED_NATS = 25.0
"""That a column must be worth, G grown again without it."""

STARTS = 2


@dataclass(frozen=True, eq=False)
class KnownInput:
    """What the search found of one column: the nats that it is worth with G grown again without it (or by how
    much its best form falls short), its way, and, where it is part of the cascade, the fit without it."""

    column: str
    way: str
    nats: float
    accepted: bool
    without: JointFit | None = None


def columns_of(records: Sequence[Record]) -> tuple[str, ...]:
    """Known inputs that every record has, which change in one at least."""
    first = records[0].known
    return tuple(
        name
        for name in first
        if all(name in record.known for record in records)
        and any(float(np.ptp(record.known[name])) > 0 for record in records)
    )


def forms_of(column: str, told: Sequence[float] = ()) -> tuple[Form, Form]:
    """The two ways in which a column may act, begun at LAGS_S; at the encoder, which it reaches as it is, at
    lags that are `told`, in samples, as well."""

    def lag(scale: JointScale, row: int) -> Slot:
        latest = min(LATEST_S * scale.rate_hz, 0.2 * scale.samples)
        return Slot(row, "lag", False, -EARLIEST_S * scale.rate_hz, latest)

    def lags(scale: JointScale) -> list[float]:
        return [s * scale.rate_hz for s in LAGS_S if s * scale.rate_hz <= 0.1 * scale.samples]

    label = LABEL + column
    return (
        Form(
            label, TORQUE, "law", lambda s: (lag(s, 0),), lambda s: [(x,) for x in lags(s)],
            K.KNOWN, K.BASE_COMMAND, column,
        ),
        Form(
            label, READING, "reading", lambda s: (Slot(0, "gain"), lag(s, 1)),
            lambda s: [(0.0, x) for x in (*told, *lags(s))], column=column,
        ),
    )  # fmt: skip


def form_named(label: str, name: str) -> Form | None:
    """The form of a known input by label and name; None for another label."""
    if not label.startswith(LABEL):
        return None
    return next((form for form in forms_of(label[len(LABEL) :]) if form.name == name), None)


def telling_lag(fit: JointFit, column: str) -> float:
    """The lag, in samples, at which steps of the error follow steps of the column most.

    Under noise close to a random walk a rough column tells nothing of its lag from more than a sample away.
    """
    records = fit.response.records
    rate = records[0].sample_rate_hz
    length = 2 * max(len(record) for record in records)
    cross = np.zeros(length)
    for record, error in zip(records, fit.point.residuals, strict=True):
        steps = np.diff(np.nan_to_num(np.stack([record.known[column], error])))
        moved, followed = np.fft.rfft(steps, length)
        cross += np.fft.irfft(moved.conj() * followed, length)
    earliest, latest = round(EARLIEST_S * rate), min(round(LATEST_S * rate), length // 10)
    earliest = min(earliest, length // 10)
    return float(np.argmax(np.abs(np.roll(cross, earliest)[: earliest + latest + 1])) - earliest)


def with_column(fit: JointFit, column: str) -> JointFit:
    """The best fit with one known input more, its G grown and pruned again."""
    trials: list[JointFit] = []
    for form in forms_of(column, (telling_lag(fit, column),)):
        starts = best_starts(screened(fit, [form]), STARTS)
        begun = [fit.with_known(form, start.values).descended(FIRST_STEPS) for start in starts]
        trials.append(highest(begun).descended())
    return pruned(regrown(highest(trials)))


def with_known_inputs(fit: JointFit) -> tuple[JointFit, tuple[KnownInput, ...]]:
    """The fit with the columns that are worth it, the strongest first, and what was found of every one.

    One that makes the noise more likely but the simulated error larger is none that the gap follows: noise
    close to a random walk weighs the steps of the error, and leaves its level to itself.
    """
    waiting = columns_of(fit.response.records)
    found: list[KnownInput] = []
    while waiting:
        trials = {column: with_column(fit, column) for column in waiting}
        sound = [column for column in waiting if trials[column].point.rms <= fit.point.rms]
        best = max(sound, key=lambda column: trials[column].score, default=None)
        if best is None or trials[best].score - fit.score < ASKED_NATS:
            for column in waiting:
                way = trials[column].values.effects[trials[column].known_count - 1].form.name
                found.append(KnownInput(column, way, trials[column].score - fit.score, False))
            return fit, tuple(found)
        way = trials[best].values.effects[trials[best].known_count - 1].form.name
        found.append(KnownInput(best, way, trials[best].score - fit.score, True, fit))
        fit, waiting = trials[best], tuple(column for column in waiting if column != best)
    return fit, tuple(found)
