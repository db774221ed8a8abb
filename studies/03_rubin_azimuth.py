"""The azimuth axis of the Rubin Observatory mount: what do ten seconds of motion at 0.1 deg/s tell?

Measured tracking data with uneven time stamps, put on 10 Hz; the initial state is estimated. The command
barely varies: the study shows what the program says when a record does not show a block. Skipped where
the data is absent.
"""

from __future__ import annotations

import numpy as np
from study import SHARED_DATA, headline, skip_without, start_study

from bayes_hw.analysis import analyse
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.record import Columns, Record

DATA = SHARED_DATA / "data" / "rubin_tma" / "20230531_azimuth.csv"
RATE_HZ = 10.0


def main() -> None:
    study = start_study("03_rubin_azimuth", __doc__)
    skip_without(DATA)
    record = Record.read(
        DATA,
        columns=Columns("timestamp", "demandVelocity", "actualPosition"),
        resample_hz=RATE_HZ,
    )
    analysis = analyse(
        "Rubin Observatory mount, azimuth",
        [record],
        [],
        np.random.default_rng(study.seed),
        start="free",
        settings=SamplerSettings(max_steps=100) if study.quick else SamplerSettings(),
        jobs=study.jobs,
        progress=study.progress,
    )
    study.write_report(analysis)
    study.write_results(headline(analysis))


if __name__ == "__main__":
    main()
