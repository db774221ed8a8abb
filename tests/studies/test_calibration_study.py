"""Axes drawn wide are what the study says, and replicates that are there are not made again."""

from __future__ import annotations

import hashlib
import importlib.util
import json
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import study as study_module
import wide_axes
from linearised_truth import linearised_at_truth
from twin_seeds import repeats_of

from bayes_hw import __version__
from bayes_hw.executor import ResultFolder
from bayes_hw.progress import Progress

SCRIPT = Path(study_module.__file__).with_name("05_calibration.py")


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The study's script as a module."""
    spec = importlib.util.spec_from_file_location("calibration_study", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def drawn() -> list[wide_axes.DrawnAxis]:
    return [wide_axes.drawn_axis(np.random.default_rng([5, i])) for i in range(30)]


def test_axes_are_drawn_as_wide_as_said(drawn: list[wide_axes.DrawnAxis]) -> None:
    facts = [each.facts for each in drawn]
    assert {f["commands"] for f in facts} == {"sweep", "slews", "operation"}
    assert {min(f["true_order"], 4) for f in facts} == {3, 4}
    assert all(3 <= f["true_order"] <= 12 and 10 <= f["rate_hz"] <= 500 for f in facts)
    assert max(f["true_modes"] for f in facts) == 3
    assert 0.3 < max(f["true_delay_s"] for f in facts) <= 1.0
    assert any("Student" in f["noise"] for f in facts)
    assert any(f["noise"] == "white" for f in facts)
    assert all(min(f["below_limit"], f["above_limit"]) >= 1e-3 for f in facts)


def test_every_axis_is_stable_and_its_limits_are_seen(drawn: list[wide_axes.DrawnAxis]) -> None:
    for each in drawn:
        each.known.model.linear.check_stable()
    assert {"saturation.lower", "saturation.upper"} <= set(linearised_at_truth(drawn[0].known))


def test_an_axis_depends_on_its_task_alone() -> None:
    task = {"source": "twin", "seed": 6, "index": 1}
    first, second = wide_axes.axis_of_task(task), wide_axes.axis_of_task(task)
    np.testing.assert_array_equal(first.known.records[1].y, second.known.records[1].y)
    assert len(first.known.model.dominant_modes) == 2
    first.known.model.linear.check_stable()


def test_effect_free_axes_are_their_models_and_noise() -> None:
    """The other simulator's records less the exact model are noise of the stated spread."""
    axis = wide_axes.effect_free_axis(7, 0).known
    assert axis.model.sample_rate_hz == 20.0
    for record in axis.records:
        left = record.y - axis.model.simulate(record.u).y
        assert np.std(left) == pytest.approx(axis.noise.sigma, rel=0.1)


def test_records_cut_in_motion_go_on_from_what_was_cut() -> None:
    """They are the same axis under the same commands and noise, without its beginning."""
    axis = wide_axes.wide_axis(np.random.default_rng([5, 1])).known
    cut = wide_axes.in_motion(axis)
    for whole, rest, commands in zip(axis.records, cut.records, cut.commands, strict=True):
        np.testing.assert_array_equal(commands, whole.u)
        np.testing.assert_array_equal(rest.y, whole.y[-len(rest) :])
        assert len(rest) < 0.8 * len(whole)


def result(held: bool) -> Mapping[str, Any]:
    return {
        "inside": {"saturation.upper": [held] * 3},
        "width": {"saturation.upper": 1.2},
        "converged": held,
    }


def test_kept_replicates_are_not_made_again(script: ModuleType, tmp_path: Path) -> None:
    options = script.SETS["wide"] | {"seed": 1001, "max_steps": script.MAX_STEPS}
    digest = hashlib.sha256(f"{__version__} {sorted(options.items())}".encode()).hexdigest()
    kept = ResultFolder(tmp_path / "replicates" / "wide", digest)
    for index in range(3):
        kept.save(index, json.dumps({"index": index}))
    counts = script.COUNTS | {"axes": 3}
    study = study_module.Study(
        "05_calibration", SCRIPT, False, 1, 1, tmp_path, Progress(quiet=True), 0.0, counts=counts,
        usual_counts=script.COUNTS,
    )  # fmt: skip
    assert script.recovered_set(study, "wide") == [{"index": index} for index in range(3)]
    assert study.command == "python studies/05_calibration.py --seed 1 --axes 3"


def test_repeats_are_counted_by_parameter() -> None:
    repeats = repeats_of([result(True), result(True), result(False)])
    assert (repeats.repeats, repeats.converged) == (3, 2)
    assert repeats.held["saturation.upper"].inside == 2
    assert repeats.median_width == {"saturation.upper": pytest.approx(1.2)}
