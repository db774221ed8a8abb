"""bayes-hw design-experiment on a corrected axis: the experiment that confirms what it has."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from bayes_hw.commands.next_step import say_next
from bayes_hw.commands.speech import say, say_page
from bayes_hw.errors import InputError
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.gap.answer.axis_with_effects import AxisWithEffects
from bayes_hw.identifiability.confirming_experiment import Experiment, Stage, confirming_experiments
from bayes_hw.identifiability.motion_limits import MotionLimits
from bayes_hw.identifiability.next_experiment import SCHEMA
from bayes_hw.provenance import provenance_of
from bayes_hw.report.experiment.confirming_report import confirming_report
from bayes_hw.report.page.render import render


def confirm(parsed: argparse.Namespace, axis: AxisWithEffects) -> None:
    """Make the command, write it with its page, and say what it is. Raises InputError where the axis may do
    none within its limits."""
    out = Path(parsed.out)
    if parsed.check or parsed.about:
        raise InputError("--check and --about go with a sampled posterior; this is a corrected model")
    motion = axis.motion
    lowest, highest = parsed.stroke or motion["stroke"]
    limits = MotionLimits(
        parsed.velocity or motion["velocity"], parsed.acceleration or motion["acceleration"], lowest, highest
    )
    model = axis.posterior.axis.model
    gain = model.linear.velocity_gain(model.sample_rate_hz)
    stage = Stage(model.sample_rate_hz, parsed.duration, limits, gain)
    information = axis.expected_information()
    found = confirming_experiments(axis.answer, stage, information.outputs, information.nats)
    narrowing = information.narrowing(found[0].u)
    write_experiment(out, stage, found, narrowing)
    origin = provenance_of(parsed)
    page = confirming_report(parsed.title or model.name, axis, stage, found, narrowing, origin)
    written = render(page, out)
    for one in found:
        say(f"{one.label:48} expected information gain {one.nats:.2f}")
    say(f"command: {out / 'command.csv'}; play it, and call the record played.csv")
    say_page(page, written)
    say_next(parsed, "report", "played.csv", "--out", "again/")


def write_experiment(out: Path, stage: Stage, found: list[Experiment], narrowing: float) -> None:
    """command.csv with columns t,u and experiment.json, both or neither."""
    first, limits = found[0], stage.limits
    content = {
        "schema": SCHEMA,
        "method": "Laplace approximation at the corrected model",
        "sample_rate_hz": stage.sample_rate_hz,
        "duration_s": len(first.u) / stage.sample_rate_hz,
        "limits": {
            "velocity": limits.velocity,
            "acceleration": limits.acceleration,
            "stroke": [limits.lowest, limits.highest],
        },
        "winner": {
            "family": first.label,
            "expected_gain_nats": first.nats,
            "sd_after_over_before": narrowing,
        },
        "candidates": [{"family": one.label, "expected_gain_nats": one.nats} for one in found],
    }
    with staged(out) as place:
        write_csv(place / "command.csv", {"t": np.arange(len(first.u)) / stage.sample_rate_hz, "u": first.u})
        write_json(place / "experiment.json", content)
