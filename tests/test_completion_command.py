"""Shell completion: the scripts complete commands, options and choices in the shells that are here."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from bayes_hw.cli import main

ASK_BASH = """
source {script}
COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
_shtab_bayes_hw; echo "${{COMPREPLY[@]}}"
"""


@pytest.fixture
def script(tmp_path: Path, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest) -> Path:
    """The script for the shell that the test asks for."""
    assert main(["completion", request.param]) == 0
    path = tmp_path / "completion"
    path.write_text(capsys.readouterr().out)
    return path


@pytest.mark.parametrize("script", ["bash"], indirect=True)
@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("bayes-hw de", {"demo", "design", "design-experiment"}),
        ("bayes-hw sample --f", {"--free"}),
        ("bayes-hw blind ru", {"run"}),
        ("bayes-hw sample --noise st", {"student-t"}),
    ],
)
def test_bash_completes(script: Path, words: str, found: set[str]) -> None:
    asked = ["bash", "-c", ASK_BASH.format(script=script, words=words)]
    done = subprocess.run(asked, capture_output=True, text=True, timeout=20, check=True)
    assert set(done.stdout.split()) == found


@pytest.mark.parametrize("script", ["zsh", "fish"], indirect=True)
def test_every_command_is_in_the_other_scripts(script: Path, request: pytest.FixtureRequest) -> None:
    """And the shell itself finds no error in its syntax, where it is installed."""
    text = script.read_text()
    for word in ("identify", "design-experiment", "holdout", "student-t"):
        assert word in text
    shell = shutil.which(request.node.callspec.params["script"])
    if shell is not None:
        subprocess.run([shell, "-n", str(script)], check=True, timeout=20)


def test_an_unknown_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["completion", "tcsh"])
    assert ended.value.code == 2
    assert "choose from" in capsys.readouterr().err
