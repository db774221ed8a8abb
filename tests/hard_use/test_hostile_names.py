"""Names that would be markup, code or paths elsewhere are text in both reports, and stay in their folder.

Figures are strokes: tests of either report draw such names.
"""

from __future__ import annotations

import html
import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_files import files_below, write_axis
from short_sampling import sample_shortly
from strokes import draw_strokes

from bayes_hw.cli import main
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.report.page.typography import visible

RECORD = '<img src=x onerror=alert(1)> #eval("1") $x$ *b* {{7*7}} @a \u202e\x1b[31m'
MODEL = '../../etc/<script>alert(2)</script> #read("/etc/passwd") \\ $y$ _i_\n\x07'
COLUMN = "</td><b onmouseover=alert(3)>u #let"
UNIT = "<i>deg</i> #v"
FEW = ("--without", *(set(LABEL_BLOCKS) - {"command_bias"}))


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Records and a model of hostile names, in the working folder."""
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        draw_strokes(patch)
        folder = write_axis(tmp_path_factory.mktemp("hostile"), small_axis)
        patch.chdir(folder)
        text = (folder / "train_1.csv").read_text().replace("t,u,y", f't,"{COLUMN}",y', 1)
        (folder / f"{RECORD}.csv").write_text(text)
        content = json.loads((folder / "model" / "model.json").read_text())
        content |= {"name": MODEL, "units": {"time": "s", "input": UNIT, "output": "deg"}}
        (folder / "hostile.json").write_text(json.dumps(content))
        yield folder


def check_both_forms(out: Path, *names: str) -> None:
    """The names show in the page as text, no tag of theirs is in it, and the PDF has its words."""
    page = (out / "report.html").read_text(encoding="utf-8")
    for tag in ("<img src=x", "<script>alert", "<b onmouseover", "<i>deg"):
        assert tag not in page
    shown = " ".join(html.unescape(page).split())
    for name in names:
        assert " ".join(visible(name).split()) in shown
    assert (out / "report.pdf").read_bytes().startswith(b"%PDF")
    if shutil.which("pdftotext"):
        done = subprocess.run(
            ["pdftotext", "-raw", str(out / "report.pdf"), "-"], capture_output=True, check=True, timeout=60
        )
        words = "".join(done.stdout.decode().split())
        assert "onerror=alert(1)" in words and "root:x:0:0" not in words


@pytest.mark.slow
def test_the_posterior_report(folder: Path) -> None:
    before = files_below(folder)
    short = ("--walkers", "32", "--max-steps", "50", "--quiet", "--input", COLUMN)
    title = ("--title", MODEL, "--model", "hostile.json")
    assert main(["report", f"{RECORD}.csv", *title, *short, "--out", "out"]) == 0
    check_both_forms(folder / "out", RECORD, UNIT)
    found = files_below(folder) - before
    assert all(name.startswith("out") for name in found)
    assert "out/bands_1.csv" in found


def test_the_diagnosis_report(folder: Path) -> None:
    """The diagnosis takes columns t, u, y alone: the hostile column is refused in one visible line."""
    text = (folder / f"{RECORD}.csv").read_text().splitlines()
    (folder / f"{RECORD} 2.csv").write_text("\n".join(["t,u,y", *text[1:]]) + "\n")
    shutil.copy(folder / "train_2.csv", folder / f"{RECORD} 3.csv")
    records = ("--train", f"{RECORD} 2.csv", "--holdout", f"{RECORD} 3.csv")
    arguments = ["diagnose", "--model", "hostile.json", *records, *FEW, "--quiet", "--out", "gap"]
    assert main(arguments) == 0
    check_both_forms(folder / "gap", f"{RECORD} 2")


def test_a_hostile_header_is_shown_in_the_complaint(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "--model", "hostile.json", f"{RECORD}.csv", "--input", "v", "--out", "run.csv"]
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.isprintable() and COLUMN in line and not (folder / "run.csv").exists()
