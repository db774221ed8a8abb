"""bayes-hw blind make | run | score: the check of the diagnosis on data whose effect is withheld."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_command, add_common, add_output, add_within
from bayes_hw.errors import InputError

NAME = "blind"
SUMMARY = "make withheld cases, diagnose them without their truth, score the verdicts"
STEP_EXAMPLES = {
    "make": "bayes-hw blind make --n 100 --seed 7 --out set/",
    "run": "bayes-hw blind run set/ --out verdicts/",
    "score": "bayes-hw blind score set/ verdicts/ --out score/",
}
EXAMPLE = "\n  ".join(STEP_EXAMPLES.values())


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The three steps as commands of their own."""
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")

    def step(name: str, summary: str) -> argparse.ArgumentParser:
        return add_command(steps, name, summary, STEP_EXAMPLES[name])

    make = step("make", "write cases and their sealed truth")
    make.add_argument("--n", type=int, default=100, metavar="N", help="cases (default 100)")
    make.add_argument(
        "--kind",
        choices=("easy", "hard", "wide", "mujoco", "beam"),
        default="hard",
        help="how the cases are spread (default hard)",
    )
    make.add_argument(
        "--effects",
        nargs="+",
        metavar="LABEL[+LABEL]",
        help="faults of the cases in turn instead of drawing them: labels, pairs as A+B, other, none",
    )
    make.add_argument(
        "--off-catalogue",
        choices=("known", "second", "unseen"),
        default="known",
        help="faults that `other` is drawn from: those the diagnosis was made with, a second group it met "
        "late, or ones it had not met when it was measured on them (default known)",
    )
    add_output(make, "folder for cases/, truth.zip and seal.json; one that was stopped is finished")
    add_common(make)
    make.set_defaults(goes_on=True)

    run_step = step("run", "diagnose the cases of a set without its truth")
    run_step.add_argument("set", metavar="DIR", help="the --out folder of make, or a folder of case folders")
    run_step.add_argument("--scheduler", metavar="ADDRESS", help="run on this Dask cluster instead")
    run_step.add_argument(
        "--practice", action="store_true", help="accept a set whose truth lies open; the verdicts say so"
    )
    run_step.add_argument(
        "--without", metavar="LABEL", help="leave this effect out of the catalogue of the diagnosis"
    )
    run_step.add_argument(
        "--from-records",
        action="store_true",
        help="withhold the model of every case: the diagnosis is given the records alone",
    )
    run_step.add_argument("--diagnosis", metavar="MODULE:FUNCTION", help="check another diagnosis")
    add_within(run_step, "of every case (another diagnosis has none)")
    add_output(run_step, "folder for the verdicts; a run that was stopped goes on from there")
    add_common(run_step)
    run_step.set_defaults(goes_on=True)

    score = step("score", "open the truth and score the verdicts")
    score.add_argument("set", metavar="DIR", help="the --out folder of make")
    score.add_argument("verdicts", metavar="VERDICTS", help="the --out folder of run")
    score.add_argument("--seal", metavar="SHA256", help="the seal as make printed it")
    score.add_argument(
        "--verdicts-sha256", metavar="SHA256", help="the digest of the verdicts as run printed it"
    )
    score.add_argument(
        "--practice", action="store_true", help="the truth lies open in DIR/truth beside the cases"
    )
    add_output(score, "folder for score.json, report.html and report.pdf")
    add_common(score)


def run(parsed: argparse.Namespace) -> None:
    """Run one step."""
    {"make": _make, "run": _run, "score": _score}[parsed.step](parsed)


def _make(parsed: argparse.Namespace) -> None:
    from bayes_hw.commands.next_step import say_next
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
        changes={} if parsed.off_catalogue == "known" else {"off_catalogue": parsed.off_catalogue},
        executor=make_executor(parsed.jobs),
        progress=Progress(parsed.quiet),
    )
    say(f"{parsed.n} cases in {out / 'cases'}; truth sealed in {out / 'truth.zip'}, SHA-256 {seal}")
    say_next(parsed, "blind", "run", str(out), "--out", "verdicts/")


def _run(parsed: argparse.Namespace) -> None:
    from bayes_hw.commands.next_step import say_next
    from bayes_hw.commands.speech import say, warn
    from bayes_hw.executor import make_executor
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.blind.run import failures, run_set
    from bayes_hw.progress import Progress

    if parsed.without and parsed.from_records:
        raise InputError("--without goes with a model; without one every effect is tried")
    out = Path(parsed.out)
    check_output_folder(out)
    options: dict[str, object] = {"without": parsed.without} if parsed.without else {}
    if parsed.diagnosis is None:
        options["within_s"] = parsed.within
    digest = run_set(
        Path(parsed.set),
        out,
        parsed.seed,
        diagnosis=parsed.diagnosis,
        options=options,
        from_records=parsed.from_records,
        truth_is_open=parsed.practice,
        executor=make_executor(parsed.jobs, parsed.scheduler),
        progress=Progress(parsed.quiet),
    )
    for case, error in failures(out).items():
        warn(f"{case}: no verdict: {error}")
    say(f"verdicts in {out}, SHA-256 {digest}")
    say_next(parsed, "blind", "score", parsed.set, str(out), "--out", "score/")


def _score(parsed: argparse.Namespace) -> None:
    import numpy as np

    from bayes_hw.commands.speech import say
    from bayes_hw.files import check_output_folder, write_json
    from bayes_hw.gap.blind.evidence import read_evidence
    from bayes_hw.gap.blind.score import score_evidence, score_to_dict
    from bayes_hw.provenance import provenance_of
    from bayes_hw.report.blind.blind_report import blind_report, share_text
    from bayes_hw.report.page.render import render

    out = Path(parsed.out)
    check_output_folder(out)
    evidence = read_evidence(
        Path(parsed.set), Path(parsed.verdicts), parsed.practice, parsed.seal, parsed.verdicts_sha256
    )
    score = score_evidence(evidence, np.random.default_rng(parsed.seed))
    write_json(out / "score.json", score_to_dict(score, evidence))
    origin = provenance_of(parsed)
    written = render(blind_report(score, evidence, origin), out)
    for name, value in score.headline.items():
        say(f"{name:48} {share_text(value)}")
    say(f"report: {written.html} and {written.pdf}")
