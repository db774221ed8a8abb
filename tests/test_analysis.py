"""The whole path for one axis with a given model: what the report is made of, and resuming it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from short_sampling import sample_shortly
from simulated_records import measured

from bayes_hw import analysis as analysis_module
from bayes_hw.analysis import Analysis, analyse, discard_checkpoints, identify_with_progress
from bayes_hw.errors import InputError
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.progress import Progress, Task
from bayes_hw.record import Record

SHORT = SamplerSettings(walkers=32, max_steps=50)


@pytest.fixture(scope="module", autouse=True)
def _short_pilot() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        yield


def analysed(axis: HammersteinWiener, record: Record, holdout: list[Record], **options: Any) -> Analysis:
    rng = np.random.default_rng(1)
    return analyse("axis", [record], holdout, rng, model=axis, settings=SHORT, **options)


@pytest.fixture(scope="module")
def analysis(small_axis: HammersteinWiener, small_record: Record) -> Analysis:
    return analysed(small_axis, small_record, [measured(small_axis, 400, seed=2)])


def test_both_posteriors_and_the_held_out_record(analysis: Analysis) -> None:
    assert analysis.held_out
    assert analysis.identification is None and analysis.fits == ()
    assert analysis.inference.posterior.axis.free == "all"
    assert analysis.inference.posterior.conditional_on == ()
    assert [prediction.record.name for prediction in analysis.predictions] == ["simulated_2"]
    assert [covered.nominal for _, covered in analysis.coverages] == [0.5, 0.8, 0.94]
    assert all(covered.agrees for _, covered in analysis.coverages)


def test_response_lies_in_its_band_up_to_half_the_rate(
    analysis: Analysis, small_axis: HammersteinWiener
) -> None:
    """The truth's magnitude is within the band, widened by its own width, at nine frequencies in ten."""
    response = analysis.response
    assert 9.9 < response.frequency_hz[-1] < 10.0
    low, high = response.magnitude_db
    assert (low < high).all()
    assert ((response.phase_deg[1] - response.phase_deg[0]) >= 0).all()
    truth = small_axis.linear.frequency_response(response.frequency_hz, small_axis.sample_rate_hz)
    level, width = 20 * np.log10(np.abs(truth)), high - low
    assert np.mean((low - width < level) & (level < high + width)) > 0.9


def test_residual_spectrum_is_that_of_white_noise(analysis: Analysis) -> None:
    """Mean level as the variance says; quantiles of a normal distribution on a line of slope one."""
    spectrum = analysis.spectrum
    assert np.mean(spectrum.density[1:]) == pytest.approx(spectrum.white_density, rel=0.15)
    assert (np.diff(spectrum.ordered) >= 0).all()
    slope = np.polyfit(spectrum.normal_quantiles, spectrum.ordered, 1)[0]
    assert slope == pytest.approx(1.0, abs=0.05)


def test_autocorrelations_start_at_one(analysis: Analysis) -> None:
    found = analysis.autocorrelations
    assert found.shape == (len(analysis.inference.posterior.names), 50)
    np.testing.assert_allclose(found[:, 0], 1.0)
    assert (np.abs(found) <= 1 + 1e-9).all()


@pytest.mark.slow
def test_without_held_out_records_the_last_training_record_is_shown(
    small_axis: HammersteinWiener, small_record: Record, tmp_path: Path
) -> None:
    """Resumed from its checkpoint the run gives the same draws; discarding leaves nothing of it."""
    folder = tmp_path / "checkpoint"
    first = analysed(small_axis, small_record, [], free="conditional", checkpoint_folder=folder)
    assert not first.held_out
    assert first.predictions[0].record is small_record
    assert first.inference.posterior.conditional_on
    assert (folder / "plan.h5").is_file()
    again = analysed(small_axis, small_record, [], free="conditional", checkpoint_folder=folder, resume=True)
    np.testing.assert_array_equal(again.inference.posterior.values, first.inference.posterior.values)
    discard_checkpoints(folder)
    assert not folder.exists()


def test_held_out_record_of_another_rate_is_refused(
    small_axis: HammersteinWiener, small_record: Record
) -> None:
    other = Record("fast", small_record.t / 2, small_record.u, small_record.y, 40.0, small_record.units)
    with pytest.raises(InputError, match="fast: sampled at 40 Hz"):
        analysed(small_axis, small_record, [other])


def test_progress_of_the_identification_never_goes_back(
    monkeypatch: pytest.MonkeyPatch, small_record: Record
) -> None:
    """Each of its steps begins at nothing again, and the last is repeated from several starts."""
    reached: list[int] = []

    def identified(*_: object, report: Callable[[str, int, int], None], **__: object) -> str:
        for stage, done in (("linear block", 1), ("input nonlinearity", 0), ("input nonlinearity", 1)):
            report(stage, done, 1)
        for done in (0, 50, 20, 90, 30):
            report("whole cascade", done, 100)
        return "found"

    monkeypatch.setattr(analysis_module, "identify", identified)
    monkeypatch.setattr(analysis_module, "with_known", lambda found, _: found)

    def reach(task: Task, done: int, note: str = "") -> None:
        del note
        task.done = done
        reached.append(done)

    monkeypatch.setattr(Task, "reach", reach)
    identify_with_progress([small_record], "axis", "rest", Progress(quiet=True))
    assert reached == sorted(reached) and reached[-1] == 100 and len(set(reached)) > 4
