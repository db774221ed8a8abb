"""bayes-hw design: what a controller designer can rely on."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from bayes_hw.commands.options import add_common, add_output

if TYPE_CHECKING:
    from bayes_hw.control.design import Design

NAME = "design"
SUMMARY = "margins, limit cycles, tracking and uncertainty sets of position controllers over a posterior"
EXAMPLE = "bayes-hw design --posterior posterior/ --controller pi.json --out design/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    parser.add_argument(
        "--posterior",
        required=True,
        metavar="DIR",
        help="the --out folder of bayes-hw sample, report or diagnose, or a corrected.json",
    )
    parser.add_argument(
        "--controller",
        nargs="+",
        default=[],
        metavar="FILE.json",
        help="PI or PID controllers; the first gives the tuned ones its rate, limits, filters and delay",
    )
    add_output(parser, "folder for design.json, design.mat, tuned controllers, report.html and report.pdf")
    group = parser.add_argument_group("what is asked of a loop")
    group.add_argument("--gain-margin", type=float, default=6.0, metavar="DB", help="default 6 dB")
    group.add_argument("--phase-margin", type=float, default=45.0, metavar="DEG", help="default 45 deg")
    group.add_argument(
        "--delay-margin",
        type=float,
        metavar="S",
        help="default one sample of the model, which nobody measured",
    )
    group.add_argument(
        "--share",
        type=float,
        default=0.95,
        help="share of draws that keep it, and of the sets (default 0.95)",
    )
    group.add_argument(
        "--tune", nargs="*", choices=("PI", "PID"), default=["PI"], help="structures to tune (default PI)"
    )
    group.add_argument("--draws", type=int, default=2000, metavar="N", help="draws (default 2000)")
    parser.add_argument("--no-report", action="store_true", help="leave out report.html and report.pdf")
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Read posterior and controllers, compute, write and say."""
    from pathlib import Path

    import numpy as np

    from bayes_hw.commands.corrected import refuse_refuted, warn_of_refuted
    from bayes_hw.commands.next_step import say_next
    from bayes_hw.commands.speech import say, say_page, warn
    from bayes_hw.control.controller import Controller
    from bayes_hw.control.design import DesignSettings, design
    from bayes_hw.control.export import write_design
    from bayes_hw.control.margins import Requirements
    from bayes_hw.errors import InputError
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.any_corrected import read_corrected_axis
    from bayes_hw.infer.posterior import Posterior
    from bayes_hw.progress import Progress
    from bayes_hw.provenance import provenance_of
    from bayes_hw.report.design.design_report import design_report
    from bayes_hw.report.page.render import remove_pages, render

    if not 0.5 <= parsed.share < 1:
        raise InputError(f"--share {parsed.share:g}: must be at least 0.5 and below 1")
    if parsed.draws < 100:
        raise InputError(f"--draws {parsed.draws}: must be 100 or more")
    out = Path(parsed.out)
    check_output_folder(out)
    corrected = read_corrected_axis(parsed.posterior)
    refuse_refuted(corrected, parsed.posterior)
    posterior = Posterior.read(parsed.posterior) if corrected is None else corrected.posterior
    delay = parsed.delay_margin
    if delay is None:
        delay = 1 / posterior.axis.model.sample_rate_hz
    requirements = Requirements(parsed.gain_margin, parsed.phase_margin, delay)
    for option, value in (
        ("--gain-margin", parsed.gain_margin),
        ("--phase-margin", parsed.phase_margin),
        ("--delay-margin", delay),
    ):
        if not value >= 0:
            raise InputError(f"{option} {value:g}: must be zero or more")
    controllers = [Controller.read(path) for path in parsed.controller]
    if not controllers and not parsed.tune:
        raise InputError("--tune: nothing to tune and no --controller; give one of them")
    progress = Progress(parsed.quiet)
    found = design(
        posterior,
        controllers,
        np.random.default_rng(parsed.seed),
        settings=DesignSettings(
            draws=parsed.draws,
            share=parsed.share,
            requirements=requirements,
            tuned=tuple(dict.fromkeys(parsed.tune)),
        ),
        jobs=parsed.jobs,
        progress=progress,
        effects=corrected,
    )
    write_design(out, found)
    remove_pages(out)
    if not posterior.converged:
        warn(f"the posterior has not converged: {posterior.problems[0]}")
    warn_of_refuted(posterior)
    if not parsed.no_report:
        with progress.stage("report"):
            origin = provenance_of(parsed)
            page = design_report(found, origin)
            written = render(page, out)
    for line in headlines(found):
        say(line)
    if not parsed.no_report:
        say_page(page, written)
    say_next(parsed, "design-experiment", "--posterior", parsed.posterior, "--out", "next/")


def headlines(found: Design) -> list[str]:
    """One line a controller."""
    import numpy as np

    requirements = found.settings.requirements
    lines = []
    for loop in found.loops:
        bandwidth = np.where(loop.margins.stable, loop.margins.bandwidth_hz, 0.0)
        lines.append(
            f"{loop.controller.name}: stable with probability {loop.probability_stable:.3f}, "
            f"margins kept with {loop.met(requirements):.3f}, bandwidth at least "
            f"{np.quantile(bandwidth, 0.05):.3g} Hz with 0.95"
        )
    return lines
