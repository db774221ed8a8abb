"""Planned commands stay within the axis's limits, and a twin that plays one is seen in full."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from simulated_axes import measured

from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.first_look.look import look
from bayes_hw.first_look.plan import AxisLimits, angle, plan

AXES = {
    "slow": (AxisLimits(0.5, 2.0, -5.0, 5.0, 0.113), 20.0, 5.0),
    "fast": (AxisLimits(3.0, 8.0, -20.0, 35.0), 200.0, 40.0),
    "short stroke": (AxisLimits(1.5, 2.0, -0.5, 0.5), 50.0, 10.0),
}


@pytest.mark.parametrize("name", AXES)
def test_commands_stay_within_the_limits_and_rest_at_both_ends(name: str) -> None:
    limits, rate, highest = AXES[name]
    found = plan(limits, np.random.default_rng(1), sample_rate_hz=rate, highest_hz=highest, duration_s=300)
    for command in (found.train, found.holdout):
        assert np.abs(command).max() <= limits.velocity
        assert np.abs(np.diff(command)).max() * rate <= limits.acceleration
        moved = angle(command, limits, rate)
        assert limits.low < moved.min() and moved.max() < limits.high
        still = round(4.9 * rate)
        assert not command[:still].any() and not command[-still:].any()
    assert len(found.train) / rate == pytest.approx(300, abs=1)
    assert (found.parts[0].start_s, found.parts[-1].end_s) == (0.0, len(found.train) / rate)
    assert all(one.end_s == other.start_s for one, other in pairwise(found.parts))
    for part in found.parts:
        played = found.train[round(part.start_s * rate) : round(part.end_s * rate)]
        assert played.any() == (part.name != "rest")


def test_bad_limits_are_named() -> None:
    limits, rate, highest = AXES["slow"]
    for changes, word in (({"velocity": -1.0}, "--velocity"), ({"low": 0.0}, "--stroke")):
        with pytest.raises(InputError, match=word):
            plan(
                replace(limits, **changes),
                np.random.default_rng(1),
                sample_rate_hz=rate,
                highest_hz=highest,
                duration_s=300,
            )
    with pytest.raises(InputError, match="--duration"):
        plan(limits, np.random.default_rng(1), sample_rate_hz=rate, highest_hz=highest, duration_s=60)


@pytest.mark.slow
def test_twin_that_plays_the_plan_shows_its_limits_and_dead_zone() -> None:
    limits, rate, highest = AXES["slow"]
    found = plan(limits, np.random.default_rng(1), sample_rate_hz=rate, highest_hz=highest, duration_s=240)
    seen = look([measured(nanshan_model(0.004), found.train, 0.0005, np.random.default_rng(2))])
    assert seen.statics.lower == pytest.approx(-0.335, abs=0.02)
    assert seen.statics.upper == pytest.approx(0.438, abs=0.02)
    assert seen.statics.half_width == pytest.approx(0.004, abs=1.5e-3)
    assert seen.delay is not None and seen.delay.low <= 0.15 <= seen.delay.high + 1e-9


def test_command_line_writes_the_commands_and_their_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limits = ["--velocity", "0.5", "--acceleration", "2", "--gain", "0.113"]
    out = ["--out", str(tmp_path / "plan")]
    assert main(["plan", *limits, "--stroke", "-5", "5", *out]) == 0
    table = np.loadtxt(tmp_path / "plan" / "train.csv", delimiter=",", skiprows=1)
    assert table.shape == (6000, 2)
    page = (tmp_path / "plan" / "report.html").read_text(encoding="utf-8")
    assert "slow triangles" in page and (tmp_path / "plan" / "report.pdf").is_file()
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "next: bayes-hw look train_1.csv train_2.csv holdout.csv --out look/"
    assert main(["plan", *limits, "--stroke", "1", "5", *out]) == 2
