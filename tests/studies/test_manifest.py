"""A manifest says what a run found and by which code, and is outdated by any change of code or files."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import manifest as module
import pytest
from manifest import REPORTS, Manifest, code_digest, digest, new_manifest, question_of, read_manifest

from bayes_hw import __version__
from bayes_hw.provenance import provenance
from bayes_hw.report.page.document import Badge, Figure, Report

COMMAND = "python studies/99_some.py --seed 3"
DONE = sorted(path.parent for path in REPORTS.glob("*/manifest.json"))


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "99_some.py"
    path.write_text('"""What is asked of the 26 m axis,\nabout +-1? More follows. And more."""\n')
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "99_some"
    path.mkdir()
    (path / "results.json").write_text("{}")
    (path / "report.html").write_text("page")
    return path


@pytest.fixture
def written(script: Path, folder: Path) -> Manifest:
    origin = provenance(COMMAND, 3, [], 12.34)
    made = new_manifest(
        "99_some",
        script,
        Report("title", "", "verdict", (Badge("label", "bad", "detail"),), Figure("<svg/>", "", ""), ()),
        origin,
        quick=True,
        folder=folder,
        files=["results.json", "report.html"],
    )
    made.write(folder)
    return made


def test_files_that_are_not_committed_are_not_listed(script: Path, folder: Path) -> None:
    """What .gitignore leaves out would be missing in every other checkout."""
    for name in ("posterior.nc", "bands_validation_1.csv", "command.csv"):
        (folder / name).write_text("1")
    report = Report("title", "", "verdict", (), Figure("<svg/>", "", ""), ())
    origin = provenance(COMMAND, 3, [], 12.34)
    names = sorted(path.name for path in folder.iterdir())
    made = new_manifest("99_some", script, report, origin, quick=True, folder=folder, files=names)
    assert set(made.files) == {"command.csv", "report.html", "results.json"}


def test_manifest_comes_back_as_written(written: Manifest, folder: Path) -> None:
    assert read_manifest(folder) == written
    assert written.question == "What is asked of the 26 m axis, about ±1?"
    assert written.headline["badges"] == [{"label": "label", "state": "bad", "detail": "detail"}]
    assert (written.version, written.seed, written.quick, written.seconds) == (__version__, 3, True, 12.3)
    assert written.packages["numpy"]
    assert written.files == {name: digest(folder / name) for name in ("report.html", "results.json")}


def test_no_manifest_or_one_of_another_schema_is_none(tmp_path: Path) -> None:
    assert read_manifest(tmp_path) is None
    (tmp_path / "manifest.json").write_text(json.dumps({"schema": "bayes-hw/study/0"}))
    assert read_manifest(tmp_path) is None


def test_done_until_command_code_or_a_file_changes(written: Manifest, folder: Path, script: Path) -> None:
    code = code_digest(script)
    assert written.is_done(folder, code, COMMAND)
    assert not written.is_done(folder, code, COMMAND + " --quick")
    assert not replace(written, code=None).is_done(folder, code, COMMAND)
    script.write_text(script.read_text() + "x = 1\n")
    assert not written.is_done(folder, code_digest(script), COMMAND)
    (folder / "report.html").write_text("another page")
    assert not written.is_done(folder, code, COMMAND)
    (folder / "report.html").unlink()
    assert not written.is_done(folder, code, COMMAND)


def test_helpers_of_the_studies_change_the_code_and_other_studies_do_not(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "studies"
    shutil.copytree(module.STUDIES, folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(module, "STUDIES", folder)
    known = code_digest(script)
    for name, changes in {
        "02_twin.py": False,
        "index.py": False,
        "rivals.py": True,
        "study.py": True,
        "pages/power_report.py": True,
    }.items():
        (folder / name).write_text((folder / name).read_text() + "\n")
        assert (code_digest(script) != known) == changes
        known = code_digest(script)


def test_any_source_of_the_package_changes_the_code(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "bayes_hw"
    shutil.copytree(module.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    before = code_digest(script)
    monkeypatch.setattr(module, "PACKAGE", copy)
    assert code_digest(script) == before
    for name in ("model/blocks.py", "report/page/templates/report.css", "gap/answer/calibration.json"):
        known = code_digest(script)
        (copy / name).write_text((copy / name).read_text() + "\n")
        assert code_digest(script) != known


@pytest.mark.parametrize("folder", DONE, ids=lambda path: path.name)
def test_committed_manifest_is_that_of_the_files_beside_it(folder: Path) -> None:
    found = read_manifest(folder)
    assert found is not None
    assert found.study == folder.name
    assert {"report.html", "report.pdf", "results.json"} <= set(found.files)
    for name, known in found.files.items():
        assert digest(folder / name) == known, name
        assert (folder / name).stat().st_size < 1.8e6, name
    assert found.question == question_of(module.STUDIES / f"{folder.name}.py")
    results = json.loads((folder / "results.json").read_text())
    assert (found.seed, found.quick) == (results["seed"], results["quick"])
    assert not found.quick
