"""A whole check by the program's own diagnosis: with its whole catalogue, and with an entry struck."""

from __future__ import annotations

from pathlib import Path

from serial import SerialExecutor

from bayes_hw.gap.blind.check import check_blind
from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.progress import Progress


def checked(folder: Path, options: dict[str, str]) -> Evidence:
    return check_blind(
        folder,
        1,
        1700,
        "easy",
        labels=[["encoder_eccentricity"]],
        changes={"rates_hz": (20.0,), "durations_s": (30.0,), "gap_over_sigma": (4.0, 6.0)},
        options=options,
        executor=SerialExecutor(),
        progress=Progress(quiet=True),
    )


def test_the_program_diagnoses_with_and_without_an_entry(tmp_path: Path) -> None:
    """Named with the entry; struck, its label is not in question and the case is not a failure."""
    (whole,) = checked(tmp_path, {}).verdicts
    assert not whole.failed and whole.answer == ("encoder_eccentricity",)
    (struck,) = checked(tmp_path, {"without": "encoder_eccentricity"}).verdicts
    assert not struck.failed and "encoder_eccentricity" not in struck.probability
    assert "encoder_eccentricity" in whole.probability
