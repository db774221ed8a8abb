"""The Python interface: what the README shows runs, agrees with the commands' numbers, and stays light."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from command_files import few_orders, write_axis
from matplotlib.figure import Figure
from short_sampling import sample_shortly

import bayes_hw
from bayes_hw.errors import BayesHWWarning, InputError
from bayes_hw.gap import diagnosis
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint import joint_diagnosis
from bayes_hw.identify.four_steps import identify
from bayes_hw.infer.inference import Inference
from bayes_hw.interface import gap_diagnosis, sampled_posterior
from bayes_hw.interface.identified_axis import IdentifiedAxis
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

DIAGNOSE = diagnosis.diagnose
INFER = sampled_posterior.infer
FEW = frozenset(LABEL_BLOCKS) - {"command_bias", "sensor_drift"}
README = Path(__file__).parents[2] / "README.md"


def diagnose_with_few(*arguments: Any, **options: Any) -> diagnosis.Diagnosis:
    """The diagnosis with a catalogue of two labels, for speed."""
    return DIAGNOSE(*arguments, **(options | {"without": FEW}))


def infer_dominant(*arguments: Any, **options: Any) -> Inference:
    """The posterior of the dominant parameters: those of two slow poles, beside, mix ten times as slowly."""
    return INFER(*arguments, **(options | {"free": "conditional"}))


@pytest.fixture(scope="module")
def shown(
    small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Any]]:
    """The names that README's Python block leaves behind, run as it stands on records of the small axis."""
    (block,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        patch.setattr(diagnosis, "diagnose", diagnose_with_few)
        few_orders(patch)
        patch.chdir(write_axis(tmp_path_factory.mktemp("axis"), small_axis))
        Path("block.py").write_text(block, encoding="utf-8")
        with patch.context() as quicker:
            quicker.setattr(sampled_posterior, "infer", infer_dominant)
            names = runpy.run_path("block.py")
        names["figure"] = Path("posterior.png").read_bytes()
        yield names


@pytest.fixture(scope="module")
def estimate(shown: dict[str, Any]) -> IdentifiedAxis:
    """Of the same records, under another seed."""
    return bayes_hw.identify(shown["records"], seed=3)


def test_the_readme_block_runs(shown: dict[str, Any], small_axis: HammersteinWiener) -> None:
    """Its posterior converges on the axis that made the records, and its figure is a picture."""
    table = shown["posterior"].to_dataframe()
    assert shown["posterior"].converged
    for name, true in (("saturation.upper", small_axis.saturation.upper), ("mode1.frequency_hz", 2.0)):
        low, high = table.loc[name, ["hdi94_low", "hdi94_high"]]
        assert low - 0.05 * true < true < high + 0.05 * true
    assert shown["figure"].startswith(b"\x89PNG")
    assert set(shown["gap"].to_dataframe().index) >= {"none", "other", "command_bias"}


def test_tables_hold_what_the_files_hold(shown: dict[str, Any]) -> None:
    """Every entry of posterior.json has its row, every label of verdict.json its probability."""
    posterior, gap = shown["posterior"], shown["gap"]
    table = posterior.to_dataframe()
    entries = posterior.posterior.to_dict()["parameters"]
    assert list(table.index) == list(entries)
    assert table.loc["gain", "mean"] == entries["gain"]["mean"]
    assert table.loc["gain", "hdi94_high"] == entries["gain"]["hdi94"][1]
    probability = gap.to_dataframe()["probability"]
    assert dict(probability) == dict(gap.verdict.probability)
    assert probability.is_monotonic_decreasing
    assert str(gap).endswith(".")


def test_the_tree_is_that_of_arviz(shown: dict[str, Any]) -> None:
    from arviz_stats import summary

    found = summary(shown["posterior"].tree, var_names=["gain"], round_to="none")
    assert isinstance(found, pd.DataFrame)
    mean = shown["posterior"].to_dataframe().loc["gain", "mean"]
    assert found.loc["gain", "mean"] == pytest.approx(mean, rel=1e-3)


def test_every_answer_draws_itself(shown: dict[str, Any], estimate: IdentifiedAxis) -> None:
    """A matplotlib figure with the record's own samples in it, without matplotlib's global state."""
    records: list[Record] = shown["records"]
    prediction = shown["posterior"].predict(records[0])
    for answer in (estimate, shown["posterior"], prediction, shown["gap"]):
        assert isinstance(answer.plot(), Figure)
    drawn = estimate.plot(1).axes[0].get_lines()[0].get_ydata()
    np.testing.assert_array_equal(drawn, records[1].y)
    assert list(prediction.to_dataframe().columns)[:6] == ["t", "u", "y", "mean", "lo", "hi"]


def test_identify_is_the_four_step_estimate(shown: dict[str, Any], estimate: IdentifiedAxis) -> None:
    table = estimate.to_dataframe()
    model = identify(shown["records"]).model
    assert table.loc["saturation.lower", "value"] == model.saturation.lower
    assert table.loc["saturation.lower", "unit"] == "deg/s"
    assert table.loc["noise.sigma", "value"] == model.noise_sigma


def test_results_can_be_written(shown: dict[str, Any], tmp_path: Path) -> None:
    shown["posterior"].write(tmp_path)
    shown["gap"].write(tmp_path)
    found = {path.name for path in tmp_path.iterdir()}
    diagnosed = {"verdict.json", "holdout_prediction.csv", "corrected.json"}
    assert found == {"posterior.nc", "posterior.json"} | diagnosed


@pytest.mark.slow
def test_importing_the_package_is_light() -> None:
    """No numpy until a name of the interface is used; then every name is there, whatever came first."""
    script = (
        "import sys, bayes_hw; assert 'numpy' not in sys.modules\n"
        "import bayes_hw.identify.four_steps as steps\n"
        "from bayes_hw import identify, sample, diagnose, Record, Units, InputError\n"
        "assert callable(identify) and identify.four_steps is steps and identify is bayes_hw.identify\n"
        "assert set(bayes_hw.__all__) <= set(dir(bayes_hw))\n"
        "assert not hasattr(bayes_hw, 'nonsense')\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", script], check=True, timeout=60)


@pytest.mark.parametrize("typo", [{"free": "everything"}, {"start": "fre"}, {"noise": "gauss"}])
def test_a_setting_that_does_not_exist_is_named(
    small_axis: HammersteinWiener, small_record: Record, typo: dict[str, Any]
) -> None:
    ((name, given),) = typo.items()
    with pytest.raises(InputError, match=f"{name}='{given}': unknown; use one of"):
        bayes_hw.sample(small_axis, [small_record], **typo)
    with pytest.raises(InputError, match="records: is empty"):
        bayes_hw.sample(small_axis, [])


def test_sample_takes_what_identify_returned_and_a_path(
    estimate: IdentifiedAxis, shown: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def inferred(model: HammersteinWiener, *_: Any, **__: Any) -> Inference:
        raise InputError(f"{model.name} of {len(model.linear.poles)} poles")

    path = tmp_path / "model.json"
    estimate.model.write(path)
    monkeypatch.setattr(sampled_posterior, "infer", inferred)
    said = f"{estimate.model.name} of {len(estimate.model.linear.poles)} poles"
    for given in (estimate.model, estimate, path, str(path)):
        with pytest.raises(InputError, match=said):
            bayes_hw.sample(given, shown["records"])


def test_a_model_of_these_very_records_is_opened_again(
    estimate: IdentifiedAxis, shown: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Structure and effects are then inferred together; around a model of other records they are not."""

    def together(*_: Any, notes: tuple[str, ...], within_s: float, **__: Any) -> None:
        raise InputError(f"{notes[0][:60]} {within_s:g}")

    def around(*_: Any, **__: Any) -> None:
        raise InputError("around the model")

    monkeypatch.setattr(joint_diagnosis, "diagnose_records", together)
    monkeypatch.setattr(gap_diagnosis, "diagnose_around", around)
    own, held_out = shown["records"], Record.read("holdout.csv")
    with pytest.raises(InputError, match=r"identified from these very records.* 30"):
        bayes_hw.diagnose(estimate, own, held_out, within_s=30)
    with pytest.raises(InputError, match="around the model"):
        bayes_hw.diagnose(estimate, held_out, own[0])
    with pytest.raises(InputError, match="around the model"):
        bayes_hw.diagnose(estimate.model, own, held_out)
    for incomplete in ((estimate, own), (estimate,)):
        with pytest.raises(InputError, match="holdout: is missing"):
            bayes_hw.diagnose(*incomplete)
    with (
        pytest.warns(BayesHWWarning, match="no record was held out"),
        pytest.raises(InputError, match="no record was held out"),
    ):
        bayes_hw.diagnose(own)


def test_a_repeat_of_a_record_is_another_record(estimate: IdentifiedAxis, shown: dict[str, Any]) -> None:
    """At 134 deg, noise of a ten thousandth of a degree alone tells the second run of a command."""
    first = shown["records"][0]
    run = replace(first, y=first.y + 134.2)
    identified = replace(estimate, records=(run.counted_from(134.2),))
    noise = 1e-4 * np.random.default_rng(1).standard_normal(len(run))
    assert identified.is_of([run]) and identified.is_of([run.counted_from(100.0)])
    assert not identified.is_of([replace(run, y=run.y + noise)])
