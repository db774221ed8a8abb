"""A whole check by the program's own diagnosis: with its whole catalogue, and with an entry struck."""

from __future__ import annotations

from pathlib import Path

import pytest
from blind_check.check import check_blind
from serial_executor import SerialExecutor

from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.progress import Progress

LABEL = "encoder_eccentricity"


def checked(folder: Path, labels: list[str], options: dict[str, str]) -> Evidence:
    return check_blind(
        folder,
        1,
        1700,
        "easy",
        labels=[labels],
        changes={"rates_hz": (20.0,), "durations_s": (30.0,), "gap_over_sigma": (4.0, 6.0)},
        options=options,
        executor=SerialExecutor(),
        progress=Progress(quiet=True),
    )


@pytest.mark.slow
def test_the_program_names_what_it_was_given(tmp_path: Path) -> None:
    (verdict,) = checked(tmp_path, [LABEL], {}).verdicts
    assert not verdict.failed and verdict.answer == (LABEL,)
    assert LABEL in verdict.probability


@pytest.mark.slow
def test_an_entry_that_is_struck_is_not_in_question(tmp_path: Path) -> None:
    (verdict,) = checked(tmp_path, [], {"without": LABEL}).verdicts
    assert not verdict.failed and verdict.answer == ()
    assert LABEL not in verdict.probability


@pytest.mark.slow
def test_the_case_of_a_struck_entry_is_no_failure(tmp_path: Path) -> None:
    """Where nothing in the catalogue fits, everything is tried."""
    (verdict,) = checked(tmp_path, [LABEL], {"without": LABEL}).verdicts
    assert not verdict.failed and LABEL not in verdict.probability
