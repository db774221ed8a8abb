"""The command line: parse, call, say."""

from __future__ import annotations

import argparse
import errno
import io
import os
import shlex
import sys
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

from bayes_hw import __version__
from bayes_hw.commands import (
    blind,
    completion,
    convert,
    demo,
    design,
    design_experiment,
    diagnose,
    identifiability,
    inspect,
    look,
    plan,
    simulate,
    validate,
)
from bayes_hw.commands.options import (
    FREE_HELP,
    RECORD_HELP,
    add_check,
    add_command,
    add_common,
    add_drive,
    add_noise,
    add_output,
    add_record_options,
    add_sampling,
    add_start,
    add_within,
)
from bayes_hw.errors import InputError
from bayes_hw.report.page.typography import visible

DESCRIPTION = """\
Bayesian Hammerstein-Wiener models of telescope servo axes: saturation, linear drive
train, dead zone, with honest uncertainties.

  a guided first hour             bayes-hw demo
  what to record                  bayes-hw plan --velocity 1.5 --acceleration 2 --stroke -5 5 --out plan/
  a first look at records         bayes-hw look azimuth.csv --out look/
  from a record to a report       bayes-hw report azimuth.csv --out azimuth/
  step by step                    bayes-hw identify azimuth.csv --out model/
                                  bayes-hw sample --model model/model.json azimuth.csv --out posterior/
                                  bayes-hw predict --posterior posterior/ new.csv --out bands.csv
  the model alone                 bayes-hw simulate --model model/model.json azimuth.csv --out run.csv
  what records cannot tell        bayes-hw identifiability model/model.json azimuth.csv --out identifiability/
  the next experiment             bayes-hw design-experiment --posterior posterior/ --velocity 1.5 --out next/
  for the controller              bayes-hw design --posterior posterior/ --out design/
  simulator against records       bayes-hw diagnose case/ --out diagnosis/
  is that diagnosis right         bayes-hw blind make, run, score
  a log as it comes               bayes-hw inspect night.csv
  other formats, MATLAB           bayes-hw convert azimuth.mat --out azimuth.csv
  are these files as they should  bayes-hw validate model.json posterior.json
  completion in your shell        bayes-hw completion bash

Each command has a --help of its own that ends with an example, and takes --seed (same seed, same machine:
same numbers), --jobs N and --quiet. The same from Python: import bayes_hw; help(bayes_hw).
"""

EPILOG = """\
A record holds time (s), velocity command and measured angle, one row a sample at a uniform rate, by
default in columns t, u, y; others are found where names and numbers leave no choice, or named with --time,
--input, --output. It is a CSV file unless it
ends in .mat (variables, or an iddata exported as a structure), .h5 or .parquet. A model is model.json,
or an idnlhw exported as a structure (.mat). Exit status: 0 done, 2 bad input or usage (one line on
stderr), 1 anything else.
"""


MODULES: tuple[Any, ...] = (
    simulate,
    demo,
    design,
    design_experiment,
    diagnose,
    blind,
    identifiability,
    convert,
    inspect,
    validate,
    look,
    plan,
    completion,
)
"""Commands with a module of their own: NAME, SUMMARY, EXAMPLE, add_arguments(parser) and run(parsed)."""

CHECKPOINT_FOLDER = "checkpoint"
"""Name of the folder in --out that keeps an unfinished run."""


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line; options are written out."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings, allow_abbrev=False)

    def error(self, message: str) -> NoReturn:
        print(_one_line(f"{self.prog}: error: {message}; see {self.prog} --help"), file=sys.stderr)
        self.exit(2)


@cache
def build_parser() -> argparse.ArgumentParser:
    """The parser of every command."""
    parser = _Parser(
        prog="bayes-hw",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"bayes-hw {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, summary: str, example: str) -> argparse.ArgumentParser:
        return add_command(subparsers, name, summary, example)

    sub = command(
        "identify",
        "four-step point estimate from records alone",
        "bayes-hw identify train_1.csv train_2.csv --holdout holdout.csv --out model/",
    )
    sub.add_argument("records", nargs="+", metavar="RECORD", help=RECORD_HELP)
    sub.add_argument(
        "--holdout", nargs="+", default=[], metavar="RECORD", help="records to validate on, not fitted to"
    )
    add_output(sub, "folder for model.json and fit.json")
    add_record_options(sub)
    add_start(sub)
    add_common(sub)

    sub = command(
        "sample",
        "posterior of a model's parameters given records",
        "bayes-hw sample --model model/model.json train_1.csv train_2.csv --out posterior/",
    )
    sub.add_argument("records", nargs="+", metavar="RECORD", help=RECORD_HELP)
    sub.add_argument(
        "--model", required=True, metavar="MODEL.json", help="the model that priors are centred on"
    )
    add_output(sub, "folder for posterior.nc and posterior.json")
    add_record_options(sub)
    add_start(sub)
    add_noise(sub)
    sub.add_argument("--free", choices=("dominant", "all"), default="all", help=FREE_HELP)
    add_check(sub)
    add_sampling(sub)
    add_common(sub)

    sub = command(
        "predict",
        "94 % bands of a record's output under a posterior",
        "bayes-hw predict --posterior posterior/ holdout.csv --out bands.csv",
    )
    sub.add_argument("record", metavar="RECORD", help=RECORD_HELP)
    sub.add_argument(
        "--posterior",
        required=True,
        metavar="DIR",
        help="the --out folder of bayes-hw sample, report or diagnose, or a corrected.json",
    )
    add_output(sub, "CSV file with columns t,u,y,mean,lo,hi,...", "FILE.csv")
    add_record_options(sub)
    add_start(sub)
    add_common(sub)

    sub = command(
        "report",
        "everything in one go: estimate, posterior, bands, report.html and report.pdf",
        "bayes-hw report train_1.csv train_2.csv --holdout holdout.csv --out azimuth/",
    )
    sub.add_argument("records", nargs="+", metavar="RECORD", help=RECORD_HELP)
    sub.add_argument(
        "--holdout", nargs="+", default=[], metavar="RECORD", help="records for the bands, not fitted to"
    )
    sub.add_argument("--model", metavar="MODEL.json", help="start from this model instead of identifying one")
    sub.add_argument(
        "--title", default="", help="title of the report (default: the name of the --out folder)"
    )
    add_output(sub, "folder for report.html, report.pdf and the files of identify, sample and predict")
    add_record_options(sub)
    add_start(sub)
    add_noise(sub)
    add_check(sub)
    add_sampling(sub)
    add_within(sub, "for what the model lacks, where records refute it,")
    add_drive(sub)
    add_common(sub)

    for module in MODULES:
        sub = command(module.NAME, module.SUMMARY, module.EXAMPLE)
        module.add_arguments(sub)
        sub.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit status.

    The commands are imported after the arguments are parsed, so that --help and usage errors answer at once.
    """
    begin = time.perf_counter()
    given = sys.argv[1:] if arguments is None else list(arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    parser = build_parser()
    parsed = parser.parse_args(given)
    parsed.parser, parsed.run_other, parsed.begin = parser, main, begin
    parsed.command_line = shlex.join(["bayes-hw", *given])
    if "default_out" in parsed and parsed.out is None:
        parsed.out = parsed.default_out(parsed)
    parsed.checkpoint = Path(getattr(parsed, "out", "")) / CHECKPOINT_FOLDER
    try:
        from bayes_hw import commands

        commands.run(parsed)
        sys.stdout.flush()
    except InputError as error:
        return _fail(2, f"error: {error}")
    except KeyboardInterrupt:
        return _fail(1, f"interrupted; {interruption_advice(parsed)}")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(1, f"error: {error}{disk_advice(error)}")
    except MemoryError:
        return _fail(1, "error: out of memory; give shorter records, or a lower rate with --resample")
    return 0


def interruption_advice(parsed: argparse.Namespace) -> str:
    """What to do after Ctrl-C."""
    if any(parsed.checkpoint.rglob("plan.h5")):
        return f"the finished steps are in {parsed.checkpoint}; the same command with --resume goes on"
    if getattr(parsed, "goes_on", False):
        return "what is finished is kept; the same command goes on from there"
    return "nothing was written; run the command again"


def disk_advice(error: OSError) -> str:
    """What to do where there is no room for a file; nothing for other errors."""
    if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return ""
    kept = "that file is" if error.filename else "results are"
    return f"; {kept} as before: make room, or give another --out, and run the command again"


def _fail(status: int, message: str) -> int:
    print(_one_line(f"bayes-hw: {message}"), file=sys.stderr)
    return status


def _one_line(message: str) -> str:
    return visible(" ".join(message.split()))


if __name__ == "__main__":
    sys.exit(main())
