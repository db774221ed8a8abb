"""Beside mujoco.sysid (least squares with intervals, structure given) on the same axes: what is each worth?

Axes of one MJCF file with parameters drawn from what is declared of them, recorded as they are and with dry
friction of the dish that the file lacks. `mujoco.sysid` estimates the declared parameters by least squares on
the simulator, once with the structure of the file and, where there is friction, once with frictionloss among
the parameters; the diagnosis is given the file alone. Same records, same simulator. Writes report.html,
report.pdf, results.json.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np
from pages.mujoco_sysid_report import Outcome, outcomes_by_case, sysid_report
from study import Study, start_study

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.diagnosis import Diagnosis, diagnose
from bayes_hw.record import Record, Units
from bayes_hw.simulators.edits import Edit
from bayes_hw.simulators.mjcf_axis import MjcfAxis
from bayes_hw.simulators.simulator_diagnosis import full_simulator, open_simulator, simulator_case

MODEL = Path(__file__).resolve().parents[1] / "docs" / "tutorials" / "azimuth.xml"
AXES, QUICK_AXES = 5, 1
SAMPLES, RECORDS = 1500, 3
SIGMA = 0.002
TORQUE = 0.2
"""Of the friction, N m: its gap is some ten times the noise."""

FRICTION = Edit("joint", "azimuth", "frictionloss", TORQUE)
LEAST, MOST = 0.3, 3.0
"""Bounds of least squares, shares of the nominal parameter."""


def main() -> None:
    study = start_study("21_mujoco_sysid", __doc__)
    try:
        import mujoco.sysid

        mujoco.sysid.optimize  # noqa: B018
    except (ImportError, AttributeError):
        print("skipped: needs pip install mujoco[sysid]")
        sys.exit(0)
    axis = open_simulator(MODEL)
    assert isinstance(axis, MjcfAxis)
    warm_up(axis)
    outcomes: list[Outcome] = []
    count = QUICK_AXES if study.quick else AXES
    with study.progress.task("axes", 2 * count) as task:
        for number in range(2 * count):
            outcomes += examined(study, axis, number // 2, rubs=bool(number % 2))
            task.reach(number + 1, f"axis {number // 2 + 1}")
    study.write_document(sysid_report(outcomes, study.origin()))
    study.write_results(
        {
            "torque_n_m": TORQUE,
            "by_case": outcomes_by_case(outcomes),
            "outcomes": [asdict(each) for each in outcomes],
        }
    )


def warm_up(axis: MjcfAxis) -> None:
    """Compile what simulates, outside the clock."""
    values = np.array([[parameter.nominal for parameter in axis.parameters]])
    axis.simulate(values, np.zeros(200))
    axis.linear.simulate(values, np.zeros(200))


def examined(study: Study, axis: MjcfAxis, number: int, rubs: bool) -> list[Outcome]:
    """What every method says of one axis."""
    rng = np.random.default_rng([study.seed, number])
    priors = [parameter.prior for parameter in axis.parameters]
    true = np.array([float(prior.quantile(np.asarray(rng.uniform(0.02, 0.98)))) for prior in priors])
    records = recorded(axis, true, rubs, rng)
    names = [parameter.name for parameter in axis.parameters]
    found = [by_least_squares(axis, records, true, rubs, knows=False)]
    if rubs:
        found.append(by_least_squares(axis, records, true, rubs, knows=True))
    begin = time.process_time()
    case, _ = simulator_case(axis, records[:-1], records[-1:])
    diagnosed = diagnose(
        case, np.random.default_rng(study.seed), jobs=study.jobs, full=full_simulator(axis, study.jobs)
    )
    seconds = time.process_time() - begin
    found.append(of_the_diagnosis(diagnosed, names, true, rubs, seconds))
    return found


def recorded(axis: MjcfAxis, true: FloatArray, rubs: bool, rng: np.random.Generator) -> list[Record]:
    """Records of the axis, the last to be held out."""
    model = axis.with_edits([*axis.base_edits(true), *([FRICTION] if rubs else [])])
    rate, found = axis.sample_rate_hz, []
    for name in [f"train_{i + 1}" for i in range(RECORDS)] + ["holdout"]:
        u = commanded(rng, rate)
        y = axis.motion(model, u, np.zeros((0, 11))) + SIGMA * rng.standard_normal(len(u))
        found.append(Record(name, np.arange(len(u)) / rate, u, y, rate, Units()))
    return found


def commanded(rng: np.random.Generator, rate: float) -> FloatArray:
    """Steps, sines and rests (SAMPLES,) in deg/s, from a second at rest."""
    parts: list[FloatArray] = [np.zeros(round(rate))]
    while sum(map(len, parts)) < SAMPLES:
        count = int(rng.integers(round(rate), round(5 * rate)))
        sine = np.sin(2 * np.pi * rng.uniform(0.1, 2.0) * np.arange(count) / rate)
        sine *= rng.uniform(0.3, 1.5)
        parts.append((np.full(count, rng.normal()), sine, np.zeros(count))[rng.integers(3)])
    return np.concatenate(parts)[:SAMPLES]


def by_least_squares(
    axis: MjcfAxis, records: list[Record], true: FloatArray, rubs: bool, knows: bool
) -> Outcome:
    """`mujoco.sysid` on the training records; where it `knows`, the friction is among its parameters."""
    from mujoco import sysid

    names = [parameter.name for parameter in axis.parameters]
    nominal = np.array([parameter.nominal for parameter in axis.parameters])
    given = sysid.ParameterDict(
        {
            name: sysid.Parameter(name, value, LEAST * value, MOST * value)
            for name, value in zip(names, nominal, strict=True)
        }
    )
    if knows:
        given.add(sysid.Parameter("frictionloss", 0.5 * TORQUE, 0.0, 10 * TORQUE))

    def simulated(x: FloatArray, u: FloatArray) -> FloatArray:
        edits = axis.base_edits(x[: len(names)])
        if knows:
            edits.append(Edit("joint", "azimuth", "frictionloss", float(x[-1])))
        return axis.motion(axis.with_edits(edits), u, np.zeros((0, 11)))

    def residuals(x: FloatArray, _: object) -> tuple[list[FloatArray], None, None]:
        return [(simulated(x, r.u) - r.y) / SIGMA for r in records[:-1]], None, None

    begin = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):
        fitted, result = sysid.optimize(given, residuals, optimizer="scipy", verbose=False)
    x = np.asarray(fitted.as_vector(), np.float64)
    left = residuals(x, None)[0]
    _, half = sysid.calculate_intervals(left, np.asarray(result.jac), alpha=0.05)
    seconds = time.process_time() - begin
    held = records[-1]
    count = len(names)
    return Outcome(
        "sysid, friction given" if knows else "sysid",
        rubs,
        [],
        {n: float((v - t) / t) for n, v, t in zip(names, x[:count], true, strict=True)},
        {n: bool(abs(v - t) <= h) for n, v, t, h in zip(names, x[:count], true, half[:count], strict=True)},
        {n: float(h / t) for n, t, h in zip(names, true, half[:count], strict=True)},
        float(np.sqrt(np.mean((simulated(x, held.u) - held.y) ** 2)) / SIGMA),
        seconds,
    )


def of_the_diagnosis(
    found: Diagnosis, names: list[str], true: FloatArray, rubs: bool, seconds: float
) -> Outcome:
    """The same of the verdict, its 94 % intervals, and the answer."""
    base = found.verdict.base
    return Outcome(
        "diagnosis",
        rubs,
        list(found.verdict.answer),
        {n: (base[n].mean - t) / t for n, t in zip(names, true.tolist(), strict=True)},
        {n: base[n].hdi94[0] <= t <= base[n].hdi94[1] for n, t in zip(names, true.tolist(), strict=True)},
        {n: (base[n].hdi94[1] - base[n].hdi94[0]) / 2 / t for n, t in zip(names, true.tolist(), strict=True)},
        found.verdict.gap_holdout.rmse_after / SIGMA,
        seconds,
    )


if __name__ == "__main__":
    main()
