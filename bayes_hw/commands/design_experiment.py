"""bayes-hw design-experiment."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_common, add_output

NAME = "design-experiment"
SUMMARY = "the command that is expected to tell most next, within the axis's limits, ready to play"
EXAMPLE = "bayes-hw design-experiment --posterior posterior/ --velocity 1.5 --out next/"
DURATION_S = 120.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of this command."""
    parser.add_argument(
        "--posterior",
        required=True,
        metavar="DIR",
        help="the --out folder of bayes-hw sample, report or diagnose, or a corrected.json: what is known",
    )
    parser.add_argument(
        "--about",
        nargs="+",
        default=[],
        metavar="NAME",
        help="parameters to learn about (default: all of the axis)",
    )
    parser.add_argument(
        "--duration", type=float, default=DURATION_S, metavar="S", help="length in s (default 120)"
    )
    group = parser.add_argument_group("what the axis may do (default: what the records of the posterior did)")
    group.add_argument("--velocity", type=float, metavar="V", help="largest command")
    group.add_argument("--acceleration", type=float, metavar="A", help="largest change of the command in 1 s")
    group.add_argument(
        "--stroke", type=float, nargs=2, metavar=("LOW", "HIGH"), help="ends of the output's range"
    )
    parser.add_argument(
        "--evaluations",
        type=int,
        default=240,
        metavar="N",
        help="commands tried in each family (default 240)",
    )
    parser.add_argument(
        "--check",
        type=int,
        default=0,
        metavar="N",
        help="simulate the experiment N times, sample again, compare the intervals (default 0)",
    )
    parser.add_argument("--title", default="", help="title of the report")
    add_output(parser, "folder for command.csv, experiment.json, report.html and report.pdf")
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Design, check when asked to, write, and say what won."""
    import numpy as np

    from bayes_hw.commands.confirm import confirm
    from bayes_hw.commands.corrected import warn_of_refuted
    from bayes_hw.commands.next_step import say_next
    from bayes_hw.commands.speech import say, say_page, warn
    from bayes_hw.errors import InputError
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.any_corrected import read_corrected_axis
    from bayes_hw.identifiability.excitation_families import Circumstances
    from bayes_hw.identifiability.experiment_check import check_design, write_design
    from bayes_hw.identifiability.motion_limits import limits_for
    from bayes_hw.identifiability.next_experiment import design_experiment, stored_records
    from bayes_hw.infer.posterior import Posterior
    from bayes_hw.progress import Progress
    from bayes_hw.provenance import provenance_of
    from bayes_hw.report.experiment.experiment_report import experiment_report
    from bayes_hw.report.page.render import render

    out, progress = Path(parsed.out), Progress(parsed.quiet)
    if not parsed.duration > 0:
        raise InputError(f"--duration {parsed.duration:g}: must be positive")
    for option, value, least in (("--evaluations", parsed.evaluations, 16), ("--check", parsed.check, 0)):
        if value < least:
            raise InputError(f"{option} {value}: must be {least} or more")
    check_output_folder(out)
    corrected = read_corrected_axis(parsed.posterior)
    if corrected is not None:
        confirm(parsed, corrected)
        return
    posterior = Posterior.read(parsed.posterior)
    records = stored_records(parsed.posterior, posterior)
    if parsed.check and not records:
        raise InputError(f"{parsed.posterior}: holds no records to check with; sample again")
    limits = limits_for(records, parsed.velocity, parsed.acceleration, parsed.stroke)
    rng, check_rng = np.random.default_rng(parsed.seed).spawn(2)
    model = posterior.mean_model()
    design = design_experiment(
        posterior,
        Circumstances(model.sample_rate_hz, parsed.duration, limits, model.saturation, parsed.seed),
        rng,
        about=parsed.about,
        records=records,
        evaluations=parsed.evaluations,
        progress=progress,
    )
    check = None
    if parsed.check:
        check = check_design(
            design,
            posterior,
            records,
            check_rng,
            replicates=parsed.check,
            jobs=parsed.jobs,
            progress=progress,
        )
    write_design(out, design, check)
    origin = provenance_of(parsed, records)
    title = parsed.title or posterior.axis.model.name
    page = experiment_report(title, design, posterior, check, origin)
    written = render(page, out)
    if not posterior.converged:
        warn(f"the posterior has not converged: {posterior.problems[0]}")
    warn_of_refuted(posterior)
    if check is not None and not check.passed:
        warn(f"predicted and obtained widths differ by {100 * check.largest_error:.0f} %")
    for candidate in design.candidates:
        say(f"{candidate.label:32} expected information gain {candidate.score:.2f}")
    if design.repeated is not None:
        say(f"{design.repeated.label:32} expected information gain {design.repeated.score:.2f}")
    if check is not None:
        say(f"widths obtained over predicted: within {100 * check.largest_error:.0f} %")
    say(f"command: {out / 'command.csv'}; play it, and call the record played.csv")
    say_page(page, written)
    say_next(parsed, "identify", "played.csv", "--out", "model/")
