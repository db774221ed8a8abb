"""Progress goes where it is wanted: a bar on a terminal, plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import io

import pytest

from bayes_hw import progress as progress_module
from bayes_hw.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def worked(progress: Progress) -> None:
    with progress.stage("reading"):
        pass
    with progress.task("sampling", 10) as task:
        task.reach(4, "R-hat 1.2")
        task.reach(10, "R-hat 1.0")
        assert task.done == 10
    progress.say("done")


def test_quiet_writes_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    worked(Progress(quiet=True))
    worked(Progress(quiet=True, stream=Terminal()))
    assert capfd.readouterr() == ("", "")


def test_plain_lines_without_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """No control characters; a line of progress no more often than the interval."""
    stream = io.StringIO()
    worked(Progress(stream=stream))
    lines = stream.getvalue().splitlines()
    assert [line.split(":")[0] for line in lines] == ["reading ...", "reading", "sampling ...", "done"]
    assert "\r" not in stream.getvalue() and "\x1b" not in stream.getvalue()
    monkeypatch.setattr(progress_module, "SECONDS_BETWEEN_LINES", 0.0)
    stream = io.StringIO()
    worked(Progress(stream=stream))
    assert "sampling: 4/10 R-hat 1.2" in stream.getvalue().splitlines()


def test_a_bar_on_a_terminal() -> None:
    stream = Terminal()
    worked(Progress(stream=stream))
    assert "\r" in stream.getvalue() and "10/10" in stream.getvalue() and "R-hat 1.0" in stream.getvalue()


def test_results_never_go_to_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    worked(Progress())
    out, err = capfd.readouterr()
    assert out == "" and "sampling" in err
