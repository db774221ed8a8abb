import base64
import json
from dataclasses import replace

import numpy as np

from bayes_hw.report.page import content
from bayes_hw.report.page.content import ZOOM_SAMPLES, report_content
from bayes_hw.report.page.document import Section


def blocks_of(content, kind):
    return [b for s in content["sections"] for b in s["blocks"] if b["kind"] == kind]


def test_content_is_json_and_numbers_run_through_the_sections(report_of):
    content = report_content(report_of("text"))
    json.dumps(content, allow_nan=False)
    assert content["key_figure"]["number"] == 1
    assert blocks_of(content, "figure")[0]["number"] == 2
    assert blocks_of(content, "zoomable_record")[0]["number"] == 3
    assert [section["id"] for section in content["sections"]] == ["section-1", "section-2"]


def test_a_page_of_heavy_drawings_has_each_of_them_once(report_of, monkeypatch):
    report = report_of("text")
    report = replace(report, key_figure=replace(report.key_figure, narrow_svg="<svg/>"))
    assert report_content(report)["key_figure"]["narrow_svg"] == "<svg/>"
    monkeypatch.setattr(content, "MOST_DRAWN_TWICE", len(report.key_figure.svg))
    assert report_content(report)["key_figure"]["narrow_svg"] is None


def test_record_keeps_small_residuals_on_a_large_angle(report_of):
    report = report_of("text")
    record = report.sections[0].blocks[-1]
    y = 350 + 1e-6 * np.arange(100)
    mean = y - 1e-7
    record = replace(record, y=y, mean=mean, lower=mean, upper=mean)
    content = report_content(replace(report, sections=(Section("only", (record,)),)))
    series = blocks_of(content, "zoomable_record")[0]["series"]
    decoded = {
        name: np.frombuffer(base64.b64decode(series[name]), dtype="<f4").astype(float)
        for name in ("y", "residual")
    }
    np.testing.assert_allclose(decoded["residual"], y - mean, rtol=1e-6)
    np.testing.assert_allclose(decoded["y"] + series["origin"], y, rtol=0, atol=1e-10)


def test_long_record_is_reduced_but_keeps_its_extremes(report_of):
    report = report_of("text")
    t = np.arange(5 * ZOOM_SAMPLES + 7) / 100
    y = np.sin(t)
    y[12345] = 9.0
    record = replace(report.sections[0].blocks[-1], t=t, y=y, mean=y, lower=y, upper=y)
    content = report_content(replace(report, sections=(Section("only", (record,)),)))
    series = blocks_of(content, "zoomable_record")[0]["series"]
    times = np.frombuffer(base64.b64decode(series["t"]), dtype="<f8")
    values = np.frombuffer(base64.b64decode(series["y"]), dtype="<f4").astype(float) + series["origin"]
    assert len(times) == len(values) <= ZOOM_SAMPLES
    assert values.max() == float(np.float32(9.0 - series["origin"])) + series["origin"]
    assert np.all(np.diff(times) >= 0)


def test_a_band_that_runs_away_is_drawn_at_its_largest(report_of):
    """An unstable draw ends beyond what a float of four bytes holds: no warning, no infinity."""
    report = report_of("text")
    record = report.sections[0].blocks[-1]
    upper = record.y + 1e108
    record = replace(record, upper=upper)
    content = report_content(replace(report, sections=(Section("only", (record,)),)))
    series = blocks_of(content, "zoomable_record")[0]["series"]
    for name in ("y", "residual"):
        assert np.isfinite(np.frombuffer(base64.b64decode(series[name]), dtype="<f4")).all()
    drawn = [
        np.frombuffer(base64.b64decode(v), dtype="<f4") for k, v in series.items() if k not in ("t", "origin")
    ]
    assert max(float(v.max()) for v in drawn) == float(np.finfo("<f4").max)
