"""bayes-hw plan: what a good record is, with the command files to play."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_common, add_output

NAME = "plan"
SUMMARY = "what to record of an axis not yet known: command files to play within its limits, and why"
EXAMPLE = "bayes-hw plan --velocity 1.5 --acceleration 2 --stroke -5 5 --rate 50 --out plan/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What the axis may do, and how it is recorded."""
    parser.add_argument("--velocity", type=float, required=True, metavar="V", help="largest command")
    parser.add_argument(
        "--acceleration", type=float, required=True, metavar="A", help="largest change of the command in 1 s"
    )
    parser.add_argument(
        "--stroke",
        type=float,
        nargs=2,
        required=True,
        metavar=("LOW", "HIGH"),
        help="ends of the angle's range, from where the axis stands",
    )
    parser.add_argument(
        "--gain", type=float, default=1.0, metavar="K", help="speed for a command of one (default 1)"
    )
    parser.add_argument("--rate", type=float, default=20.0, metavar="HZ", help="sample rate (default 20)")
    parser.add_argument(
        "--highest",
        type=float,
        metavar="HZ",
        help="highest frequency, above the resonances of interest (default: a quarter of the rate)",
    )
    parser.add_argument(
        "--duration", type=float, default=300.0, metavar="S", help="length of the record in s (default 300)"
    )
    add_output(parser, "folder for train.csv and holdout.csv, columns t,u, plan.json and the report")
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Plan, write, and say why; raises InputError before anything is written."""
    from dataclasses import asdict

    import numpy as np

    from bayes_hw.commands.next_step import say_next
    from bayes_hw.commands.speech import say, say_page
    from bayes_hw.files import check_output_folder, staged, write_csv, write_json
    from bayes_hw.first_look.plan import AxisLimits, plan
    from bayes_hw.provenance import provenance_of
    from bayes_hw.report.page.render import render
    from bayes_hw.report.plan.plan_report import plan_report

    out = Path(parsed.out)
    check_output_folder(out)
    low, high = parsed.stroke
    limits = AxisLimits(parsed.velocity, parsed.acceleration, low, high, parsed.gain)
    found = plan(
        limits,
        np.random.default_rng(parsed.seed),
        sample_rate_hz=parsed.rate,
        highest_hz=parsed.rate / 4 if parsed.highest is None else parsed.highest,
        duration_s=parsed.duration,
    )
    content = {
        "schema": "bayes-hw/plan/1",
        "sample_rate_hz": found.sample_rate_hz,
        "duration_s": len(found.train) / found.sample_rate_hz,
        "parts": [asdict(part) for part in found.parts],
        "reasons": list(found.reasons),
        "command": parsed.command_line,
    }
    with staged(out) as place:
        for name, command in (("train", found.train), ("holdout", found.holdout)):
            write_csv(
                place / f"{name}.csv", {"t": np.arange(len(command)) / found.sample_rate_hz, "u": command}
            )
        write_json(place / "plan.json", content)
    page = plan_report(found, limits, provenance_of(parsed))
    written = render(page, out)
    say(f"commands: {out / 'train.csv'}, to play twice, and {out / 'holdout.csv'}, once")
    say_page(page, written)
    say_next(parsed, "look", "train_1.csv", "train_2.csv", "holdout.csv", "--out", "look/")
