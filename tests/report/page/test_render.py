import pytest

from bayes_hw.errors import InputError
from bayes_hw.report.page.render import render


def test_render_writes_both_files_and_nothing_else(report_of, tmp_path):
    written = render(report_of("text"), tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["report.html", "report.pdf"]
    assert written.html.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert written.pdf.read_bytes().startswith(b"%PDF-")


def test_folder_that_is_a_file_is_refused_in_one_line(report_of, tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InputError) as error:
        render(report_of("text"), tmp_path / "out")
    assert "\n" not in str(error.value)
