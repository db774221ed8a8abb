"""A result says what made it."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import pytest

from bayes_hw import __version__
from bayes_hw import provenance as provenance_module
from bayes_hw.provenance import PACKAGES, git_state, provenance
from bayes_hw.record import Record


def test_everything_needed_to_repeat_it_is_there(small_record: Record) -> None:
    measured = replace(small_record, source="train_1.csv", sha256="ab" * 32)
    found = provenance("bayes-hw sample --seed 7", 7, [measured, small_record], 12.34)
    rows = dict(found.rows())
    assert found.version == __version__ and rows["bayes_hw"].startswith(__version__)
    assert rows["command"] == "bayes-hw sample --seed 7" and rows["seed"] == "7"
    assert rows["SHA-256 of train_1.csv"] == "ab" * 32
    assert rows[f"record {small_record.name}"] == "simulated"
    assert all(re.search(rf"{name} \d", rows["packages"]) for name in PACKAGES)
    assert rows["wall time"] == "12.3 s"
    twice = provenance("bayes-hw sample --seed 7", 7, [measured, measured, small_record], 12.34)
    assert twice.records == found.records
    assert len(rows) == len(found.rows())


def test_the_time_stated_is_that_which_the_user_has_waited() -> None:
    """Until the rows are written, not until the numbers were there."""
    began = time.perf_counter() - 100.0
    found = provenance("bayes-hw report", 1, [], 2.0, began)
    assert 100.0 <= found.waited <= time.perf_counter() - began
    stated = float(dict(found.rows())["wall time"].removesuffix(" s"))
    assert 99.9 <= stated <= time.perf_counter() - began + 0.1


def test_git_state_without_git(monkeypatch: pytest.MonkeyPatch) -> None:
    """An installed package or a machine without git is no reason to fail."""
    monkeypatch.setattr(provenance_module, "__file__", "/nowhere/bayes_hw/provenance.py")
    assert git_state() == "not a git checkout"


@pytest.mark.parametrize("error", [FileNotFoundError("git"), subprocess.TimeoutExpired("git", 10)])
def test_git_that_fails_is_said(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def fail(*_: object) -> str:
        raise error

    monkeypatch.setattr(provenance_module, "_git", fail)
    assert git_state() in ("git state unknown", "not a git checkout")


def test_git_state_names_commit_and_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = {"rev-parse": "0123456789ab", "status": " M x.py"}
    monkeypatch.setattr(provenance_module, "_git", lambda _, command, *__: answers[command])
    if git_state() != "not a git checkout":
        assert git_state() == "commit 0123456789ab, with uncommitted changes"
        answers["status"] = ""
        assert git_state() == "commit 0123456789ab"


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_changed_results_are_no_changes_of_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a checkout of its own: a result is written anew, then a line of code changes."""
    for name in ("bayes_hw/code.py", "reports/results.json"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text("1", encoding="utf-8")
    identity = ("-c", "user.name=A", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
    for arguments in (["init", "-q"], ["add", "."], [*identity, "commit", "-q", "-m", "first"]):
        subprocess.run(["git", "-C", str(tmp_path), *arguments], check=True, timeout=60)
    monkeypatch.setattr(provenance_module, "__file__", str(tmp_path / "bayes_hw" / "provenance.py"))
    (tmp_path / "reports" / "results.json").write_text("2", encoding="utf-8")
    assert "changes" not in git_state()
    (tmp_path / "bayes_hw" / "code.py").write_text("2", encoding="utf-8")
    assert git_state().endswith("with uncommitted changes")
