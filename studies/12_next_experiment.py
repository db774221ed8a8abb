"""Which experiment next? The twin after one cautious record: designed, predicted, simulated, sampled again.

One sweep of the Nanshan 26 m twin that reaches no limit leaves both limits to their priors. The experiment of
largest expected information within stated limits is designed from that posterior, and the predicted 94 %
intervals are compared with those obtained by simulating it on axes drawn from the posterior: within 20 %.
Writes report.html, report.pdf, results.json and command.csv.
"""

from __future__ import annotations

import numpy as np
from study import start_study
from twin import twin_records

from bayes_hw.identifiability.excitation_families import Circumstances
from bayes_hw.identifiability.experiment_check import check_design, write_design
from bayes_hw.identifiability.motion_limits import MotionLimits
from bayes_hw.identifiability.next_experiment import EVALUATIONS, design_experiment
from bayes_hw.infer.inference import infer
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.report.experiment.experiment_report import experiment_report

SMALL_AMPLITUDE = 0.25
LIMITS = MotionLimits(velocity=1.2, acceleration=6.0, lowest=-1.5, highest=1.5)
DURATION_S = 120.0
REPLICATES = 8
QUICK_DURATION_S = 40.0


def main() -> None:
    study = start_study("12_next_experiment", __doc__)
    data_rng, infer_rng, design_rng, check_rng = np.random.default_rng(study.seed).spawn(4)
    duration = QUICK_DURATION_S if study.quick else DURATION_S
    twin = twin_records(data_rng, amplitude=SMALL_AMPLITUDE, duration_s=duration)
    settings = SamplerSettings(walkers=48, max_steps=75) if study.quick else SamplerSettings()
    records = twin.train[:1]
    posterior = infer(
        twin.truth, records, infer_rng, settings=settings, jobs=study.jobs, progress=study.progress
    ).posterior
    model = posterior.mean_model()
    design = design_experiment(
        posterior,
        Circumstances(model.sample_rate_hz, duration, LIMITS, model.saturation, study.seed),
        design_rng,
        records=records,
        evaluations=20 if study.quick else EVALUATIONS,
        progress=study.progress,
    )
    check = check_design(
        design,
        posterior,
        records,
        check_rng,
        replicates=1 if study.quick else REPLICATES,
        settings=settings,
        jobs=study.jobs,
        progress=study.progress,
    )
    write_design(study.out, design, check)
    study.write_document(
        experiment_report("Nanshan 26 m twin", design, posterior, check, study.origin(records))
    )
    study.write_results(
        {
            "now": posterior.to_dict(),
            "prior_dominated_now": list(posterior.prior_dominated),
            "design": design.to_dict(),
            "check": check.to_dict(),
        }
    )
    for candidate in design.candidates:
        print(f"{candidate.label:32} {candidate.score:.2f} nats")
    print(
        f"widths obtained over predicted: within {100 * check.largest_error:.0f} %"
        f" over {len(check.obtained)} simulated experiments"
    )


if __name__ == "__main__":
    main()
