"""Which constants make the diagnosis state its probabilities best?

Cases of two kinds (easy, hard) are drawn from the torque-level plant with seeds kept for calibration and
diagnosed without their truth, and cases of every effect with its entry struck from the catalogue, since none
holds all there is. What every decision rests on is kept, and the constants of the decision are fitted to the
truth by the log score, cross-validated. So are the tails of base parameters, whose posteriors
are too sure where an explanation is not right. The same sets are diagnosed from their records alone too
(unless --no-from-records), and the constants of that decision's probabilities fitted: joint_calibration.json.
Those around a model whose drive train is not read are fitted on axes of other makers (MuJoCo):
given_calibration.json. Both state every constant with the deviation of its logarithm, and go with the program
in bayes_hw/gap/joint/decision. Writes calibration.json too (bayes_hw/gap/answer/calibration.json).
Finished cases stay in OUT/work until the results are written, so that a run that was stopped goes on.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from blind_check.ballot import Ballot
from blind_check.calibrate import CalibrationCase, calibrate
from blind_check.check import check_blind, verdicts_in
from blind_check.joint_calibrate import (
    Constants,
    GivenCase,
    JointCase,
    Scored,
    calibrate_jointly,
    left_out_scores,
    log_deviations,
)
from blind_check.kept_evidence import read_evidence_of, read_given_evidence_of
from blind_check.seeds import CALIBRATION_SEEDS
from blind_check.tails import TailFit, standardized_errors
from pages.decision_report import decision_report, stated_of_blocks
from study import Study, start_study

from bayes_hw.files import write_json
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict, Evidence
from bayes_hw.gap.blind.run import DIAGNOSIS, FROM_RECORDS, GIVEN_MODEL
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.gap.joint.decision.given_decision import GivenCalibration
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration

WITH_BALLOT = "blind_check.ballot:diagnose_with_ballot"
SEEDS_OF_A_STUDY = 20
BLOCK = 46
"""Blocks of seeds on which the diagnosis was developed come before: it looks surer of cases it was
changed for than of others."""

NUMBERS = {"easy": 110, "hard": 60}
QUICK_NUMBERS = {"easy": 4}
STRUCK = "easy, entry struck"
EACH_STRUCK = 4
FOREIGN = 60
"""Cases of other makers' axes."""

FIGURES = 3
"""Of a constant, that are kept."""


def main() -> None:
    study = start_study("19_decision_constants", __doc__, diagnoses=True)
    function = WITH_BALLOT if study.diagnosis == DIAGNOSIS else study.diagnosis
    cases: list[CalibrationCase] = []
    errors = []
    seeds: dict[str, tuple[list[int], int]] = {}
    for kind, count in (QUICK_NUMBERS if study.quick else NUMBERS).items():
        number = count if study.quick else study.part_of(count)
        seed = seed_of(study, len(LABEL_BLOCKS) + list(NUMBERS).index(kind))
        folder = study.out / "work" / kind
        evidence = check_blind(
            folder, number, seed, kind, diagnosis=function, executor=study.executor(), progress=study.progress
        )
        for truth, verdict, ballot in with_ballots(evidence, verdicts_in(folder, function)):
            cases.append(CalibrationCase.of(ballot, truth.effects))
            errors.append(standardized_errors(truth, verdict))
        seeds[kind] = ([seed], number)
    struck, of_struck = cases_struck(study, function)
    cases += struck
    seeds[STRUCK] = (of_struck, len(struck))
    fit = calibrate(cases, study.progress)
    tails = TailFit(errors)
    astray = {"astray_share": tails.tails.share, "astray_scale": tails.tails.scale}
    adopted = {
        name: value if name == "sigma_log_sd" else float(f"{value:.{FIGURES}g}")
        for name, value in asdict(replace(fit.adopted, **astray)).items()
    }
    write_json(study.out / "calibration.json", adopted)
    study.write_document(decision_report(fit, tails, seeds, study.origin()))
    from_records, around_models = dict[str, object](), dict[str, object]()
    if study.from_records and study.diagnosis == DIAGNOSIS:
        from_records = fit_from_records(study)
        if not study.quick:
            around_models = fit_around_models(study)
    gain, error = fit.gain
    tail_gain, tail_error = tails.gain
    alone, with_tails = tails.held()
    study.write_results(
        {
            "seeds": {kind: {"seeds": own, "cases": number} for kind, (own, number) in seeds.items()},
            "cases": len(cases),
            "names_fitted": list(fit.names),
            "gains_by_constants_fitted": {str(count): list(its) for count, its in fit.gains.items()},
            "gain_left_out": gain,
            "gain_standard_error": error,
            "right_by_hand": int(fit.right(fit.by_hand).sum()),
            "right_left_out": int(fit.right(fit.left_out).sum()),
            "right_fitted": int(fit.right(fit.as_fitted).sum()),
            "blocks_right": stated_of_blocks(fit, fit.left_out)[0].to_dict(),
            "blocks_stated_by_hand": stated_of_blocks(fit, fit.by_hand)[1],
            "blocks_stated_left_out": stated_of_blocks(fit, fit.left_out)[1],
            "base_gain_left_out": tail_gain,
            "base_gain_standard_error": tail_error,
            "base_held_by_posteriors": alone.to_dict(),
            "base_held_left_out": with_tails.to_dict(),
            "fitted": asdict(replace(fit.fitted, **astray)),
            "adopted": adopted,
            "from_records": from_records,
            "around_models": around_models,
        }
    )
    shutil.rmtree(study.out / "work")
    print(f"log score of cases left out: {gain:+.3f} ± {error:.3f} a case against constants by hand")
    for name, value in adopted.items():
        print(f"{name:20} {value:g}")


def fit_from_records(study: Study) -> dict[str, object]:
    """Fit what is stated from records alone to the truth of the same sets; writes joint_calibration.json."""
    cases = []
    for kind, count in (QUICK_NUMBERS if study.quick else NUMBERS).items():
        number = count if study.quick else study.part_of(count)
        folder, seed = (
            study.out / "work" / kind,
            seed_of(study, len(LABEL_BLOCKS) + list(NUMBERS).index(kind)),
        )
        evidence = check_blind(
            folder, number, seed, kind, diagnosis=FROM_RECORDS, from_records=True,
            executor=study.executor(), progress=study.progress,
        )  # fmt: skip
        verdicts = verdicts_in(folder, FROM_RECORDS, from_records=True)
        cases += [
            JointCase(read_evidence_of(verdicts / truth.name), truth.effects)
            for truth, verdict in zip(evidence.truths, evidence.verdicts, strict=True)
            if not verdict.failed
        ]
    return fitted_to(cases, JointCalibration.built_in(), study.out)


def fit_around_models(study: Study) -> dict[str, object]:
    """Fit what is stated around given models to the truth of axes whose train is not read; writes
    given_calibration.json."""
    folder, seed = study.out / "work" / "mujoco", seed_of(study, len(LABEL_BLOCKS) + len(NUMBERS))
    evidence = check_blind(
        folder, study.part_of(FOREIGN), seed, "mujoco", diagnosis=GIVEN_MODEL,
        executor=study.executor(), progress=study.progress,
    )  # fmt: skip
    verdicts = verdicts_in(folder, GIVEN_MODEL)
    cases = []
    for truth, verdict in zip(evidence.truths, evidence.verdicts, strict=True):
        rests_on = None if verdict.failed else read_given_evidence_of(verdicts / truth.name)
        if rests_on is not None:
            cases.append(GivenCase(rests_on, truth.effects))
    return fitted_to(cases, GivenCalibration.built_in(), study.out)


def fitted_to(cases: Sequence[Scored[Constants]], by_hand: Constants, folder: Path) -> dict[str, object]:
    """The constants fitted to cases, and how much better they state what is so; writes their file."""
    fitted = calibrate_jointly(cases, by_hand)
    doubts = log_deviations(cases, fitted, by_hand)
    adopted = {
        name: {"value": float(f"{value:.{FIGURES}g}"), "log_sd": float(f"{doubts[name]:.2g}")}
        for name, value in asdict(fitted).items()
    }
    write_json(folder / by_hand.FILE, adopted)
    return {
        "cases": len(cases),
        "score_built_in": float(sum(case.score(by_hand) for case in cases)) / len(cases),
        "score_left_out": float(left_out_scores(cases, by_hand).mean()),
        "adopted": adopted,
    }


def seed_of(study: Study, number: int) -> int:
    """The seed of the set of this number: every `--seed` has its block of those for calibration."""
    blocks = len(CALIBRATION_SEEDS) // SEEDS_OF_A_STUDY
    return CALIBRATION_SEEDS[(BLOCK + study.seed) % blocks * SEEDS_OF_A_STUDY + number]


def cases_struck(study: Study, function: str) -> tuple[list[CalibrationCase], list[int]]:
    """Cases of one effect each whose entry was struck from the catalogue, and the seeds of their sets."""
    labels = list(LABEL_BLOCKS)[-1:] if study.quick else list(LABEL_BLOCKS)
    cases, seeds = [], []
    for number, label in enumerate(labels):
        seed = seed_of(study, number)
        folder, options = study.out / "work" / f"without_{label}", {"without": label}
        evidence = check_blind(
            folder,
            study.part_of(EACH_STRUCK),
            seed,
            "easy",
            labels=[[label]],
            options=options,
            diagnosis=function,
            executor=study.executor(),
            progress=study.progress,
        )
        found = with_ballots(evidence, verdicts_in(folder, function, options))
        cases += [CalibrationCase.without(ballot, label) for _, _, ballot in found]
        seeds.append(seed)
    return cases, seeds


def with_ballots(evidence: Evidence, verdicts: Path) -> Iterator[tuple[CaseTruth, CaseVerdict, Ballot]]:
    """Truth, verdict and ballot of every case that did not fail; `verdicts` is the folder of the verdicts."""
    for truth, verdict in zip(evidence.truths, evidence.verdicts, strict=True):
        if not verdict.failed:
            yield truth, verdict, Ballot.read(verdicts / truth.name)


if __name__ == "__main__":
    main()
