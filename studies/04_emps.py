"""Does a Hammerstein-Wiener model hold for the EMPS positioning axis, a linear drive with friction?

A motor and a ball screw, measured in closed loop (Janot, Gautier, Brunot, Workshop on Nonlinear System
Identification Benchmarks 2019): drive command in V, position in m at 1 kHz, put on 100 Hz (the command
averaged over each interval, the position taken at its end). The first 60 % are fitted, the rest held out;
the published open-loop simulation errors are on another record. Skipped where the data is absent.
"""

from __future__ import annotations

import numpy as np
from study import SHARED_DATA, headline, skip_without, start_study

from bayes_hw.analysis import analyse
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.record import Columns, Record, Units

DATA = SHARED_DATA / "data" / "emps" / "DATA_EMPS.mat"
RATE_HZ = 100.0
TRAINING_SHARE = 0.6


def main() -> None:
    study = start_study("04_emps", __doc__)
    skip_without(DATA)
    record = Record.read(
        DATA,
        columns=Columns("t", "vir", "qm"),
        resample_hz=RATE_HZ,
        units=Units(input="V", output="m"),
    )
    training, held_out = record.split(TRAINING_SHARE)
    analysis = analyse(
        "EMPS positioning axis",
        [training],
        [held_out],
        np.random.default_rng(study.seed),
        start="free",
        settings=SamplerSettings(max_steps=100 if study.quick else 12000),
        jobs=study.jobs,
        progress=study.progress,
    )
    study.write_report(analysis)
    residual = held_out.y - analysis.predictions[0].mean
    study.write_results(
        {"held_out_rmse_mm": 1000 * float(np.sqrt(np.mean(residual**2))), **headline(analysis)}
    )


if __name__ == "__main__":
    main()
