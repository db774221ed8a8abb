"""What the program writes is what its schemas say, and what they refuse is refused with its place."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from bayes_hw.cli import build_parser, main
from bayes_hw.control.controller import Controller
from bayes_hw.errors import InputError
from bayes_hw.file_schemas import MAKERS, check_file, schema_of
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.infer.inference import infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

ESTIMATE = {"mean": 1.0, "sd": 0.1, "hdi94": [0.8, 1.2], "unit": "deg"}
CLOSURE = {
    "rmse_before": 1.0,
    "rmse_after": 0.5,
    "noise_floor": None,
    "closed": 0.8,
    "closed_hdi94": [None, 0.9],
}
VERDICT: dict[str, Any] = {
    "schema": "bayes-hw/verdict/1",
    "answer": ["friction"],
    "probability": dict.fromkeys(["none", "other", *LABEL_BLOCKS], 0.01) | {"friction": 0.9},
    "confusable": [["friction", "backlash"]],
    "where": {"block": "drive", "band_hz": [0.0, 1.0], "regime": "all", "share": {"drive": 1.0}},
    "gap": {"train": CLOSURE, "holdout": CLOSURE},
    "parameters": {"friction.torque": ESTIMATE},
    "base": {"gain": ESTIMATE},
    "next_experiment": None,
    "seconds": 1.0,
}


def written(path: Path, content: Any) -> Path:
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("kind", MAKERS)
def test_schemas_are_schemas(kind: str) -> None:
    Draft202012Validator.check_schema(schema_of(kind))


def test_the_command_knows_every_kind() -> None:
    (commands,) = (a for a in build_parser()._actions if isinstance(a.choices, dict))
    assert isinstance(commands.choices, dict)
    (kinds,) = (a for a in commands.choices["validate"]._actions if a.dest == "kind")
    assert tuple(kinds.choices or ()) == tuple(MAKERS)


def test_models_controllers_and_posteriors_of_the_program_are_valid(
    small_axis: HammersteinWiener, small_record: Record, tmp_path: Path
) -> None:
    small_axis.write(tmp_path / "model.json")
    assert check_file(tmp_path / "model.json") == "model"
    controller = Controller("PI", 20.0, 3.0, speed_limit=(-np.inf, np.inf))
    assert check_file(written(tmp_path / "pi.json", controller.to_dict())) == "controller"
    short = SamplerSettings(ensembles=2, walkers=32, max_steps=25, target_ess=50)
    found = infer(small_axis, [small_record], np.random.default_rng(1), settings=short)
    assert check_file(written(tmp_path / "any.json", found.posterior.to_dict())) == "posterior"


def changed(place: str, value: Any) -> Callable[[dict[str, Any]], None]:
    def change(content: dict[str, Any]) -> None:
        *parents, last = place.split("/")
        for parent in parents:
            content = content[parent]
        content[last] = value

    return change


def without(key: str) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.pop(key)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without("base"), "verdict.json: the top level: 'base' is a required property"),
        (changed("probability/friction", 1.2), "verdict.json: probability.friction: 1.2 is greater than"),
        (changed("where/block", "gearbox"), "verdict.json: where.block: 'gearbox' is not one of"),
        (changed("base/gain/hdi94", [1.0]), r"verdict.json: base.gain.hdi94: \[1.0\] is too short"),
        (changed("parameters", {"torque": ESTIMATE}), "verdict.json: parameters: 'torque' does not match"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(
    change: Callable[[dict[str, Any]], None], said: str, tmp_path: Path
) -> None:
    content = json.loads(json.dumps(VERDICT))
    assert check_file(written(tmp_path / "verdict.json", content)) == "verdict"
    change(content)
    with pytest.raises(InputError, match=said):
        check_file(written(tmp_path / "verdict.json", content))


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = written(tmp_path / "verdict.json", VERDICT)
    assert main(["validate", str(good)]) == 0
    assert capsys.readouterr().out == f"{good}: a valid verdict\n"
    unknown = written(tmp_path / "what.json", {})
    assert main(["validate", str(unknown)]) == 2
    assert "give --kind case or model" in capsys.readouterr().err
    assert main(["validate", str(unknown), "--kind", "case"]) == 2
    assert "required property" in capsys.readouterr().err
    (tmp_path / "model.json").write_text("{")
    assert main(["validate", str(tmp_path / "model.json")]) == 2
    assert "is not JSON" in capsys.readouterr().err
