"""The whole analysis: blocks that records do not show are prior-dominated, and everything is written."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from identifiability.conftest import swinging

from bayes_hw.identifiability.analysis import Identifiability, analyse_identifiability
from bayes_hw.infer.inference import StartCondition
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SHORT = SamplerSettings(ensembles=2, walkers=32, max_steps=75, target_ess=200)


def analysed(model: HammersteinWiener, record: Record, start: StartCondition = "rest") -> Identifiability:
    rng = np.random.default_rng(1)
    return analyse_identifiability("test", model, [record], rng, start=start, settings=SHORT, points=10)


def verdicts(result: Identifiability) -> dict[str, str]:
    return {verdict.name: verdict.verdict for verdict in result.verdicts}


@pytest.fixture(scope="module")
def shown(small_axis: HammersteinWiener, swinging_record: Record) -> Identifiability:
    return analysed(small_axis, swinging_record)


@pytest.mark.slow
def test_a_record_that_shows_everything(shown: Identifiability) -> None:
    found = verdicts(shown)
    assert {found[name] for name in ("saturation.lower", "saturation.upper", "gain")} == {"identified"}
    assert "prior-dominated" not in found.values()
    assert {verdict.verdict for verdict in shown.flat} == {"exactly flat"}
    assert {verdict.name for verdict in shown.flat}.isdisjoint({"mode1.frequency_hz", "mode1.damping_ratio"})
    all_free, chart, paper = shown.spectra
    assert np.all(all_free.eigenvalues[-2:] < 1e-6 * all_free.eigenvalues[0])
    assert min(chart.eigenvalues[-1], paper.eigenvalues[-1]) > 1
    for verdict in shown.verdicts:
        if verdict.prior_sensitivity is not None:
            assert verdict.prior_sensitivity < 0.05 < verdict.likelihood_sensitivity


@pytest.mark.slow
def test_what_is_never_reached_is_prior_dominated(small_axis: HammersteinWiener) -> None:
    """Limits that small commands do not reach, and the dead zone, far above which the record begins at an
    unknown state, its negative side as well; and nothing else but what the record cannot show either."""
    record = swinging(small_axis, 5, share=0.35, start=3.0)
    assert np.min(record.y) > 0.3
    result = analysed(small_axis, record, "free")
    found = verdicts(result)
    assert found["saturation.lower"] == found["saturation.upper"] == "prior-dominated"
    assert found["dead_zone.half_width"] == "prior-dominated"
    assert found["dead_zone.gain_negative"] == found["dead_zone.half_width_negative"] == "prior-dominated"
    assert found["gain"] == found["mode1.frequency_hz"] == "identified"
    by_name = {verdict.name: verdict for verdict in result.verdicts}
    assert by_name["saturation.upper"].upper_side == "open"
    assert by_name["saturation.upper"].prior_sensitivity > 0.05
    assert all(test.decision == "undecided" for test in result.assumptions)


@pytest.mark.slow
def test_files_hold_what_was_found(shown: Identifiability, tmp_path: Path) -> None:
    shown.write(tmp_path)
    content = json.loads((tmp_path / "identifiability.json").read_text())
    assert content["schema"] == "bayes-hw/identifiability/1"
    assert set(content["verdicts"]) == set(verdicts(shown))
    assert len(content["profiles"]["gain"]["nuisance"]["saturation.upper"]) == len(
        content["profiles"]["gain"]["values"]
    )
    with (tmp_path / "freed_draws.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert tuple(header) == shown.freed.names
    assert len(rows) > 1000
