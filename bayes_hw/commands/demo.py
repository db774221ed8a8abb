"""bayes-hw demo: record, model, posterior, verdict on a simulated axis, each step with its command."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import textwrap
from pathlib import Path
from typing import Any

from bayes_hw.commands.options import add_common

NAME = "demo"
SUMMARY = "a guided first hour in about a minute: simulated records, model, posterior, verdict"
EXAMPLE = "bayes-hw demo --out demo/"

RECORD_SEED = 1
WIDTH = 88

WELCOME = """\
Somewhere there is a telescope axis whose simulator is not quite right. Here one is simulated at torque
level: motor, velocity loop, gear, load and structure, and, hidden in it, {effect}. You get what an
engineer would have: three training records and one held out of commands and encoder angles, and a
simulator whose numbers are a few percent off. They are in {case}: train_1.csv to train_3.csv,
holdout.csv and model.json. Do not look into truth.json yet."""

IDENTIFY = """\
1. Which model fits these records? Saturation, linear block and dead zone are estimated from the
training records alone, and checked on the one held out."""

IDENTIFIED = """\
The model explains {fit:.1f} % of the record held out, a linear one {linear:.1f} %. That looks good. It
says that the first mode lies at {frequency}; keep that in mind."""

SAMPLE = """\
2. How sure are its parameters? Their posterior is sampled by ensembles of walkers that must agree
before the intervals are shown. With --free dominant the zeros of the axis follow the other parameters and
are drawn about where these put them, which is quicker and gives the same intervals."""

SAMPLED = """\
{interval}Mind the warnings, though:
residuals that are not white still hold something of the axis, and intervals from a model that lacks it
are too sure."""

DIAGNOSE = """\
3. Why do simulator and records differ? Every effect of the catalogue is added to the simulator in turn,
alone and in pairs, with the simulator's own numbers estimated again each time; the best must also leave
nothing unexplained and predict the record held out, whose output no fit has seen. This takes the
longest, half a minute or so."""

DIAGNOSED = """\
The truth was: {truth}. Its first mode lies at {true_frequency:.3f} Hz; the model without the effect
said {frequency}, the simulator with it says {repaired:.3f} +- {error:.3f} Hz. The verdict was
{answer}: {judgement}."""

FAREWELL = """\
Open {report} for the pictures: where the gap lies, which effects were weighed, how far it shrinks.
truth.json in {case} is no secret now. With records of your own (columns t, u, y), the commands above
are all there is to it; `bayes-hw --help` lists the rest."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where to write, and which effect to hide in the axis."""
    parser.set_defaults(out_is_folder=True)
    parser.add_argument(
        "--out", default="bayes-hw-demo", metavar="DIR", help="folder of all files (default bayes-hw-demo)"
    )
    parser.add_argument(
        "--effect",
        choices=("friction", "backlash"),
        default="friction",
        help="what the simulator lacks (default friction)",
    )
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Simulate, then run the commands that it prints; raises InputError where the folder cannot be used."""
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.blind.make import write_open_case

    out = Path(parsed.out)
    case = out / "case"
    check_output_folder(out)
    made = write_open_case(case, RECORD_SEED, (parsed.effect,))
    train = [str(case / name) for name in made.train]
    holdout = str(case / made.holdout)
    model, posterior = out / "identified" / "model.json", out / "posterior"

    tell(parsed, WELCOME, effect=parsed.effect, case=f"{case}/")
    tell(parsed, IDENTIFY)
    run_command(parsed, "identify", *train, "--holdout", holdout, "--out", str(model.parent))
    found = read_json(model.parent / "fit.json")["validation"][0]
    frequency = first_mode(read_json(model))
    tell(
        parsed,
        IDENTIFIED,
        fit=found["hammerstein_wiener"],
        linear=found["linear"],
        frequency=frequency,
    )

    tell(parsed, SAMPLE)
    run_command(
        parsed, "sample", "--model", str(model), *train, "--free", "dominant", "--out", str(posterior)
    )
    sampled = read_json(posterior / "posterior.json")["parameters"].get("mode1.frequency_hz")
    ends = sampled["hdi94"] if sampled else ()
    interval = "The interval of the first mode is {:.2f} to {:.2f} Hz. ".format(*ends) if ends else ""
    tell(parsed, SAMPLED, interval=interval)

    tell(parsed, DIAGNOSE)
    run_command(parsed, "diagnose", str(case), "--out", str(out / "diagnosis"))
    verdict = read_json(out / "diagnosis" / "verdict.json")
    truth = read_json(case / "truth.json")
    repaired = verdict["base"]["mode1.frequency_hz"]
    tell(
        parsed,
        DIAGNOSED,
        truth=", ".join(made.forms),
        true_frequency=truth["base"]["mode1.frequency_hz"],
        frequency=frequency,
        repaired=repaired["mean"],
        error=repaired["sd"],
        answer=" and ".join(verdict["answer"]) or "no structural gap",
        judgement="right" if verdict["answer"] == truth["effects"] else "not right this time",
    )
    tell(parsed, FAREWELL, report=out / "diagnosis" / "report.html", case=f"{case}/")


def run_command(parsed: argparse.Namespace, *arguments: str) -> None:
    """Print one command line and run it; ends with its exit status where it fails."""
    from bayes_hw.commands.speech import say

    given = [*arguments, "--seed", str(parsed.seed)] if parsed.seed != 1 else list(arguments)
    if not parsed.quiet:
        say(f"    $ {shlex.join(['bayes-hw', *given])}")
        sys.stdout.flush()
    given += ["--jobs", str(parsed.jobs), *(["--quiet"] if parsed.quiet else [])]
    status = parsed.run_other(given)
    if status:
        raise SystemExit(status)


def tell(parsed: argparse.Namespace, text: str, **values: object) -> None:
    """A paragraph with its values filled in, between blank lines; nothing when quiet."""
    from bayes_hw.commands.speech import say

    if parsed.quiet:
        return
    say("")
    for line in textwrap.wrap(" ".join(text.format(**values).split()), WIDTH):
        say(line)
    say("")
    sys.stdout.flush()


def first_mode(model: dict[str, Any]) -> str:
    """Frequency of the first dominant mode, in words."""
    modes = model["dominant_modes"]
    return f"{modes[0]['frequency_hz']:.2f} Hz" if modes else "no frequency at all (it has none)"


def read_json(path: Path) -> dict[str, Any]:
    """The content of a file that a command has just written."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
