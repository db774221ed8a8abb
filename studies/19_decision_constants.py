"""Which constants make the diagnosis state its probabilities best?

Cases of two kinds (easy, hard) are drawn from the torque-level plant with seeds kept for calibration and
diagnosed without their truth; what every decision rests on is kept, and the constants of the decision are
fitted to the truth by the log score, cross-validated. Writes calibration.json, which is what goes with the
program (bayes_hw/gap/calibration.json). Finished cases stay in OUT/work until the results are written, so
that a run that was stopped goes on.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict

from study import start_study

from bayes_hw.files import write_text_atomically
from bayes_hw.gap.blind.ballot import Ballot
from bayes_hw.gap.blind.calibrate import CalibrationCase, calibrate, names_fitted
from bayes_hw.gap.blind.check import check_blind
from bayes_hw.gap.blind.run import DIAGNOSIS
from bayes_hw.gap.blind.seeds import CALIBRATION_SEEDS
from bayes_hw.report.decision_report import decision_report

WITH_BALLOT = "bayes_hw.gap.blind.ballot:diagnose_with_ballot"
FIRST_SEED = 910
NUMBERS = {"easy": 110, "hard": 60}
QUICK_NUMBERS = {"easy": 6}
FIGURES = 3
"""Of a constant, that are kept."""


def main() -> None:
    study = start_study("19_decision_constants", __doc__, diagnoses=True)
    function = WITH_BALLOT if study.diagnosis == DIAGNOSIS else study.diagnosis
    cases, seeds = [], {}
    for kind, count in (QUICK_NUMBERS if study.quick else NUMBERS).items():
        number = count if study.quick else study.part_of(count)
        seed = CALIBRATION_SEEDS.start + FIRST_SEED + 10 * (study.seed - 1) + list(NUMBERS).index(kind)
        assert seed in CALIBRATION_SEEDS
        folder = study.out / "work" / kind
        evidence = check_blind(
            folder, number, seed, kind, diagnosis=function, executor=study.executor(), progress=study.progress
        )
        verdicts = folder / f"verdicts_{function.rpartition(':')[2]}"
        cases += [
            CalibrationCase.of(Ballot.read(verdicts / truth.name), truth.effects)
            for truth, verdict in zip(evidence.truths, evidence.verdicts, strict=True)
            if not verdict.failed
        ]
        seeds[kind] = (seed, number)
    fit = calibrate(cases, study.progress)
    adopted = {
        name: float(f"{value:.{FIGURES}g}") if name in names_fitted() else value
        for name, value in asdict(fit.adopted).items()
    }
    write_text_atomically(study.out / "calibration.json", json.dumps(adopted, indent=1) + "\n")
    study.write_document(decision_report(fit, seeds, study.origin()))
    gain, error = fit.gain
    study.write_results(
        {
            "seeds": {kind: {"seed": seed, "cases": number} for kind, (seed, number) in seeds.items()},
            "cases": len(cases),
            "gain_left_out": gain,
            "gain_standard_error": error,
            "right_by_hand": int(fit.right(fit.by_hand).sum()),
            "right_left_out": int(fit.right(fit.left_out).sum()),
            "right_fitted": int(fit.right(fit.as_fitted).sum()),
            "fitted": asdict(fit.fitted),
            "adopted": adopted,
        }
    )
    shutil.rmtree(study.out / "work")
    print(f"log score of cases left out: {gain:+.3f} ± {error:.3f} a case against constants by hand")
    for name in names_fitted():
        print(f"{name:20} {adopted[name]:g}")


if __name__ == "__main__":
    main()
