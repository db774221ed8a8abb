"""Diagnoses that stand in for the real one: quick, and wrong in known ways."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from blind_check.ballot import BALLOT, Ballot

from bayes_hw.gap.answer.judgement import Claim, Remains
from bayes_hw.gap.blind.counts import CLASSES
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def verdict(answer: list[str], sure: float = 0.9, **changes: Any) -> dict[str, Any]:
    """A verdict in the fixed format that states `sure` for its answer."""
    said = answer or ["none"]
    rest = (1 - sure) / (len(CLASSES) - len(said))
    gap = {
        "rmse_before": 1.0,
        "rmse_after": 0.5,
        "noise_floor": 0.4,
        "closed": 0.8,
        "closed_hdi94": [0.7, 0.9],
    }
    return {
        "schema": "bayes-hw/verdict/1",
        "answer": answer,
        "probability": {name: sure if name in said else rest for name in CLASSES},
        "confusable": [],
        "where": {
            "block": LABEL_BLOCKS.get(said[0], "sensor"),
            "band_hz": [0.0, 1.0],
            "regime": "everywhere",
            "share": {},
        },
        "gap": {"train": gap, "holdout": gap},
        "parameters": {},
        "base": {},
        "next_experiment": None,
        "seconds": 1.0,
    } | changes


def write_verdict(out: Path, content: dict[str, Any], before: np.ndarray, after: np.ndarray) -> None:
    """The two files that a diagnosis leaves."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "verdict.json").write_text(json.dumps(content))
    with (out / "holdout_prediction.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["t", "before", "after", "lo", "hi"])
        rows.writerows(
            [0.0, b, a, a - 1, a + 1] for b, a in zip(before.tolist(), after.tolist(), strict=True)
        )


def always_nothing(case: Path, out: Path, seed: int, **options: str) -> None:  # noqa: ARG001
    """Says that there is no gap, and predicts with the given simulator, without one rest."""
    u = Record.read(case / "holdout.csv").u
    model = case / "model.json"
    y = HammersteinWiener.read(model).simulate(u).y if model.exists() else np.zeros(len(u))
    write_verdict(out, verdict([]), y, y)


def nothing_with_ballot(case: Path, out: Path, seed: int, **options: str) -> None:
    """Says the same, on the ground of evidence drawn from the seed."""
    always_nothing(case, out, seed, **options)
    gains = np.random.default_rng([seed, int(case.name[-4:])]).normal(10.0, 10.0, 2)
    claims = {(): Claim(0.0), ("wind",): Claim(float(gains[0])), ("friction",): Claim(float(gains[1]))}
    ballot = Ballot(claims, dict.fromkeys(claims, Remains(())), tuple(LABEL_BLOCKS))
    (out / BALLOT).write_text(json.dumps(ballot.to_dict()))


def by_the_files(case: Path, out: Path, seed: int, **options: str) -> None:  # noqa: ARG001
    """Names an effect drawn from the bytes of the hold-out and the seed; notes which files it could see."""
    shown = sorted(path.name for path in case.parent.rglob("*") if path.is_file())
    rng = np.random.default_rng([seed, len((case / "holdout.csv").read_bytes())])
    label = str(rng.choice(list(LABEL_BLOCKS)))
    zeros = np.zeros(len(Record.read(case / "holdout.csv")))
    described = sorted(json.loads((case / "case.json").read_text()))
    write_verdict(out, verdict([label], seen=shown, described=described), zeros, zeros)


def fails(case: Path, out: Path, seed: int) -> None:  # noqa: ARG001
    """Gives no verdict on the first case."""
    if case.name == "case_0000":
        raise ValueError("cannot fit")
    write_verdict(out, verdict(["wind"]), np.zeros(3), np.zeros(3))
