"""Options that several commands share; light, so that --help answers at once."""

from __future__ import annotations

import argparse
import os
from typing import TypeVar

from bayes_hw.time_budget import SEARCH_S

FREE_HELP = (
    "all (default): walkers move in every number of the model; dominant: in limits, dead zone, gain, poles "
    "and noise, and the zeros of G are drawn where these put them, which is quicker; the same intervals, "
    "since the exact posterior weighs the draws, and as with all where the weights are poor"
)

RECORD_HELP = "a record: text such as .csv, .mat, .h5, .parquet, .fits, .tdms, .mcap, .json"


Parser = TypeVar("Parser", bound=argparse.ArgumentParser)


def add_command(
    subparsers: argparse._SubParsersAction[Parser], name: str, summary: str, example: str
) -> Parser:
    """A command, or a step of one, whose help begins with its summary and ends with an example."""
    return subparsers.add_parser(
        name,
        help=summary.replace("%", "%%"),
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def add_output(
    parser: argparse.ArgumentParser, text: str, metavar: str = "DIR", *, required: bool = True
) -> None:
    """--out, checked before anything is computed; a folder (DIR) is held for this process alone."""
    parser.set_defaults(out_is_folder=metavar == "DIR")
    parser.add_argument("--out", required=required, metavar=metavar, help=text)


def add_record_options(parser: argparse.ArgumentParser) -> None:
    """How columns, clocks, rates, gaps and units of the records are read."""
    group = parser.add_argument_group("how to read the records (bayes-hw inspect FILE says what to give)")
    group.add_argument(
        "--time",
        default="t",
        metavar="NAME",
        help="time column (default t, else found): s, Unix time, ISO 8601, MATLAB's datetime, MJD; or none",
    )
    group.add_argument(
        "--input",
        default="u",
        metavar="NAME",
        help="command column (default u, else found where names and numbers leave no choice); names without "
        "their units, or numbers from 1 without a header",
    )
    group.add_argument(
        "--output", default="y", metavar="NAME", help="measured column (default y, else found)"
    )
    group.add_argument(
        "--input-position", metavar="NAME", help="the command is a position: its difference is the velocity"
    )
    group.add_argument(
        "--known", action="append", default=[], metavar="NAME", help="a further measured column"
    )
    group.add_argument(
        "--join",
        action="append",
        default=[],
        metavar="FILE",
        help="further columns, from a file with its own clock",
    )
    group.add_argument(
        "--clock-offset",
        metavar="NAME",
        help="a column that the files of --join log as well: the offset of their clocks is estimated from it,"
        " said with its interval, and taken out",
    )
    group.add_argument("--output-time", metavar="NAME", help="the clock of the output, where it has its own")
    group.add_argument(
        "--time-unit", metavar="UNIT", help="unit of the time column: s, ms, us, ns, min, h, d"
    )
    group.add_argument("--sample-rate", type=float, metavar="HZ", help="needed where there is no time column")
    group.add_argument(
        "--resample",
        type=float,
        metavar="HZ",
        help="put records with uneven time stamps, or another rate, on this rate",
    )
    group.add_argument(
        "--gaps",
        choices=("refuse", "split", "bridge"),
        default="refuse",
        help="missing samples: refused (default); split: every gap begins a new record; bridge: up to 3 in a"
        " row stay in the record as unmeasured, longer gaps begin a new one; an hour of summer time is no"
        " gap, and is taken out by both",
    )
    group.add_argument(
        "--missing",
        action="append",
        default=[],
        metavar="READING",
        help="a reading that means that nothing was measured, such as -999; ends: those at either end of the"
        " converter",
    )
    group.add_argument(
        "--part", type=float, nargs=2, metavar=("START", "STOP"), help="read this stretch alone, s"
    )
    group.add_argument("--unwrap", type=float, metavar="TURN", help="the angle wraps at TURN (360, 6.283...)")
    group.add_argument("--reverse", action="store_true", help="the output counts against the command")
    group.add_argument(
        "--input-unit",
        metavar="UNIT",
        help="unit of the command: what to convert to where the file states one, else what it is in (deg/s)",
    )
    group.add_argument("--output-unit", metavar="UNIT", help="unit of the output, likewise (deg)")
    group.add_argument(
        "--ignore-units",
        action="store_true",
        help="the units that the file states are wrong: --input-unit and --output-unit say what it is in",
    )
    group.add_argument(
        "--accept",
        action="append",
        default=[],
        choices=("swapped", "position", "scale", "stuck", "unrelated"),
        help="take a record in spite of what was found in it",
    )


def add_start(parser: argparse.ArgumentParser) -> None:
    """--start auto, rest or free; --origin start or absolute."""
    group = parser.add_argument_group("how the records begin")
    group.add_argument(
        "--start",
        choices=("auto", "rest", "free"),
        default="auto",
        help="rest: every record starts at rest; free: its initial state is estimated; auto (default): free"
        " where a record begins in motion",
    )
    group.add_argument(
        "--origin",
        choices=("start", "absolute"),
        default="start",
        help="start (default): the angles of a record count from where it begins; absolute: from zero of the"
        " encoder",
    )


def add_within(parser: argparse.ArgumentParser, what: str = "") -> None:
    """--within, of a search for causes."""
    parser.add_argument(
        "--within",
        type=positive_seconds,
        default=SEARCH_S,
        metavar="SECONDS",
        help=f"time{what and ' '}{what} after which the search answers with what it has, and says so "
        "(default %(default)s); what comes after it takes some seconds more",
    )


def positive_seconds(text: str) -> float:
    """Of an option."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not seconds > 0:
        raise argparse.ArgumentTypeError(f"{text!r} is no time; give seconds above zero")
    return seconds


def add_drive(parser: argparse.ArgumentParser) -> None:
    """--inertia and --rated-torque: what states torques in N m and as a share."""
    group = parser.add_argument_group("the drive, as seen at the axis (torques are then stated in N m)")
    group.add_argument(
        "--inertia", type=float, metavar="KGM2", help="inertia of what turns with the encoder, kg m^2"
    )
    group.add_argument("--rated-torque", type=float, metavar="NM", help="rated torque of the drive, N m")


def add_noise(parser: argparse.ArgumentParser) -> None:
    """--noise normal, student-t or auto."""
    parser.add_argument(
        "--noise",
        choices=("normal", "student-t", "auto"),
        default="auto",
        help="innovations of the noise: normal; student-t, for outliers; auto (default): student-t where the"
        " Bayesian information criterion says so",
    )


def add_check(parser: argparse.ArgumentParser) -> None:
    """--check N."""
    parser.add_argument(
        "--check",
        type=int,
        default=0,
        metavar="N",
        help="simulate N times from the posterior under the same commands, identify and sample each anew, "
        "and say how often the intervals held (default 0; goes on from OUT/check where interrupted)",
    )


def add_sampling(parser: argparse.ArgumentParser, *, resumable: bool = True) -> None:
    """Settings of the sampler, and --resume where the command keeps a checkpoint."""
    group = parser.add_argument_group("sampling")
    group.add_argument(
        "--ensembles", type=int, default=4, metavar="N", help="ensembles, four or more (default 4)"
    )
    group.add_argument(
        "--walkers", type=int, metavar="N", help="walkers of an ensemble (default by dimension)"
    )
    group.add_argument(
        "--max-steps", type=int, default=5000, metavar="N", help="stop at the latest here (default 5000)"
    )
    group.add_argument(
        "--target-ess",
        type=float,
        default=1000.0,
        metavar="N",
        help="effective samples to stop at (default 1000)",
    )
    if resumable:
        group.add_argument("--resume", action="store_true", help="go on from the checkpoint in --out")


def add_common(parser: argparse.ArgumentParser) -> None:
    """--seed, --jobs and --quiet, which every command takes."""
    parser.add_argument("--seed", type=int, default=1, help="seed of every random number (default 1)")
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="threads (default: all cores)"
    )
    parser.add_argument(
        "--quiet", action="store_true", help="no progress on the way; answers and warnings stay"
    )
