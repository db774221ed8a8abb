"""The report on measured axes: what was named first, figures beside published ones, other parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pages.real_axes_report import Compared, Parted, RealAxis, real_axes_report
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.simulator import FunctionSimulator
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.gap.diagnosis import diagnose
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, LogNormal
from bayes_hw.provenance import provenance
from bayes_hw.record import Record, Units
from bayes_hw.report.page.document import Report, Table
from bayes_hw.report.page.render import render
from bayes_hw.report.page.rounding import format_number

UNITS = Units(input="V", output="rpm")


def speed(values: FloatArray, inputs: FloatArray) -> FloatArray:
    return np.array([lfilter([0.0, 0.1 * gain], [1.0, -0.9], inputs) for gain in values[:, 0]])


@pytest.fixture(scope="module")
def report() -> Report:
    gain = Parameter("gain", "rpm/V", 30.0, LogNormal(30.0, 0.2), Logarithm())
    simulator = FunctionSimulator("motor", speed, (gain,), 20.0, UNITS)
    rng = np.random.default_rng(4)
    records = []
    for name in ("one", "two"):
        u = np.repeat(rng.uniform(-9, 9, 20), 20)
        moved = np.sign(u) * np.maximum(np.abs(u) - 2.0, 0)
        y = speed(np.array([[31.0]]), moved)[0] + rng.normal(0, 1, len(u))
        records.append(Record(name, np.arange(len(u)) / 20.0, u, y, 20.0, UNITS))
    case = SimulatorCase.of_records(simulator, records[:1], records[1:])
    diagnosis = diagnose(case, np.random.default_rng(1))
    rows = (Compared("width", "V", 2.0, "2.1 V"), Compared("mass", "kg", float("nan"), "7 kg"))
    axis = RealAxis("motor", diagnosis, "a dead zone", "Remark.", rows)
    parted = [Parted("motor, other part", "dead_zone", 0.9, 20.0, 1.0, "rpm")]
    return real_axes_report([axis], parted, provenance("study", 1, records, 1.0))


def test_the_answer_stands_first_and_beside_what_is_known(report: Report) -> None:
    assert report.verdict.startswith("motor: dead_zone, ")
    assert report.badges[0].label == "dead_zone"
    tables = [block for section in report.sections for block in section.blocks if isinstance(block, Table)]
    (overview,) = tables[0].rows
    assert overview[:2] == ("motor", "a dead zone") and overview[2].startswith("dead_zone")
    beside = next(table for table in tables if table.header[-1].startswith("published"))
    assert beside.rows == (("width", format_number(2.0, 3, "V"), "2.1 V"), ("mass", "—", "7 kg"))
    assert tables[-1].rows[0][:2] == ("motor, other part", "dead_zone")


def test_it_renders(report: Report, tmp_path: Path) -> None:
    written = render(report, tmp_path)
    assert written.html.stat().st_size > 10_000 and written.pdf.stat().st_size > 10_000
