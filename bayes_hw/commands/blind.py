"""bayes-hw blind make | run | score: the check of the diagnosis on data whose effect is withheld."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_common, add_output

NAME = "blind"
SUMMARY = "make withheld cases, diagnose them without their truth, score the verdicts"
EXAMPLE = (
    "bayes-hw blind make --n 100 --seed 7 --out set/\n"
    "  bayes-hw blind run set/ --out verdicts/\n"
    "  bayes-hw blind score set/ verdicts/ --out score/"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The three steps as commands of their own."""
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")

    make = steps.add_parser("make", help="write cases and their sealed truth")
    make.add_argument("--n", type=int, default=100, metavar="N", help="cases (default 100)")
    make.add_argument(
        "--kind",
        choices=("easy", "hard", "wide"),
        default="hard",
        help="how the cases are spread (default hard)",
    )
    make.add_argument(
        "--effects",
        nargs="+",
        metavar="LABEL[+LABEL]",
        help="faults of the cases in turn instead of drawing them: labels, pairs as A+B, other, none",
    )
    add_output(make, "folder for cases/, truth.zip and seal.json")
    add_common(make)


def run(parsed: argparse.Namespace) -> None:
    """Run one step."""
    {"make": _make}[parsed.step](parsed)


def _make(parsed: argparse.Namespace) -> None:
    from bayes_hw.commands.speech import say
    from bayes_hw.executor import make_executor
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.blind.make import make_set
    from bayes_hw.progress import Progress

    out = Path(parsed.out)
    check_output_folder(out)
    labels = None
    if parsed.effects:
        labels = [() if text == "none" else tuple(text.split("+")) for text in parsed.effects]
    seal = make_set(
        out,
        parsed.n,
        parsed.seed,
        parsed.kind,
        labels=labels,
        executor=make_executor(parsed.jobs),
        progress=Progress(parsed.quiet),
    )
    say(f"{parsed.n} cases in {out / 'cases'}; truth sealed in {out / 'truth.zip'}, SHA-256 {seal}")
