"""How small a gap is still named right, and how does that change with record length and excitation?

Cases with one effect each, of gaps from 0.08 to 2.5 times the noise, are drawn from the torque-level plant in
several settings and diagnosed without their truth. For every effect, the smallest gap that is named right
with 90 % probability; for every setting, the same over all effects. Finished cases stay in OUT/work until the
results are written, so that a run that was stopped goes on.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from blind_check.check import check_blind
from blind_check.power import SmallestGap, smallest_gap
from blind_check.seeds import REPORT_SEEDS
from pages.power_report import PowerStudy, power_report
from study import Study, start_study

from bayes_hw.gap.blind.counts import named_right
from bayes_hw.gap.blind.evidence import CaseTruth, Evidence
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.plant.kinds import CAMPAIGN

GAPS = (0.08, 2.5)
OPERATION = ("slews_and_tracking", "raster_scan", "telegraph", "acceptance_run")
SWEEPS = ("plain_sweep", "modulated_sweep", "flat_multisine", "acceptance_run")
BASE: Mapping[str, Any] = {
    "rates_hz": (20.0,),
    "durations_s": (120.0,),
    "gap_over_sigma": GAPS,
    "excitations": CAMPAIGN,
}
SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "120 s, campaign": {},
    "30 s, campaign": {"durations_s": (30.0,)},
    "60 s, campaign": {"durations_s": (60.0,)},
    "240 s, campaign": {"durations_s": (240.0,)},
    "120 s, sweeps": {"excitations": SWEEPS},
    "120 s, operation": {"excitations": OPERATION},
}
EACH = 12
EACH_ELSEWHERE = 3


def main() -> None:
    study = start_study("09_power", __doc__, diagnoses=True)
    labels = list(LABEL_BLOCKS)[:2] if study.quick else list(LABEL_BLOCKS)
    settings = list(SETTINGS)[1:2] if study.quick else list(SETTINGS)
    checks = {}
    for number, name in enumerate(settings):
        each = study.part_of(EACH if number == 0 else EACH_ELSEWHERE)
        checks[name] = evidence_of(study, name, number, labels, each)
    first = checks[settings[0]]
    by_effect = {label: of_cases(first, [label]) for label in labels}
    by_setting = {name: of_cases(check, labels) for name, check in checks.items()}
    result = PowerStudy(by_effect, by_setting, settings[0], outcomes(first, labels))
    study.write_document(power_report(result, study.origin()))
    study.write_results(
        {
            "by_effect": {name: gap_to_dict(gap) for name, gap in by_effect.items()},
            "by_setting": {name: gap_to_dict(gap) for name, gap in by_setting.items()},
            "outcomes": {name: outcomes(check, labels) for name, check in checks.items()},
        }
    )
    shutil.rmtree(study.out / "work")
    for name, gap in (by_effect | by_setting).items():
        print(f"{name:24} {gap.gap:.2f} [{gap.interval[0]:.2f}, {gap.interval[1]:.2f}] ({gap.trials} cases)")


def evidence_of(study: Study, name: str, number: int, labels: Sequence[str], each: int) -> Evidence:
    """The finished check of one setting."""
    return check_blind(
        study.out / "work" / f"setting_{number}",
        each * len(labels),
        REPORT_SEEDS.start + 500 + 10 * study.seed + number,
        "hard",
        labels=[[label] for label in labels],
        changes={**BASE, **SETTINGS[name]},
        diagnosis=study.diagnosis,
        executor=study.executor(),
        progress=study.progress,
    )


def of_cases(check: Evidence, labels: Sequence[str]) -> SmallestGap:
    """The smallest gap over the cases that carry one of these labels."""
    chosen = [(t, v) for t, v in zip(check.truths, check.verdicts, strict=True) if t.effects[0] in labels]
    return smallest_gap([gap_of(t) for t, _ in chosen], [named_right(t, v) for t, v in chosen], GAPS)


def outcomes(check: Evidence, labels: Sequence[str]) -> dict[str, list[tuple[float, bool]]]:
    """Gap and whether it was named right, of every case, by label."""
    pairs = list(zip(check.truths, check.verdicts, strict=True))
    return {
        label: [(gap_of(t), named_right(t, v)) for t, v in pairs if t.effects[0] == label] for label in labels
    }


def gap_of(truth: CaseTruth) -> float:
    """The only gap of a case, over the noise."""
    return truth.gap_over_sigma[0]


def gap_to_dict(gap: SmallestGap) -> dict[str, object]:
    """For results.json: an end beyond the gaps tried is null."""
    ends = [end if np.isfinite(end) else None for end in gap.interval]
    return asdict(gap) | {"gap": gap.gap if np.isfinite(gap.gap) else None, "interval": ends}


if __name__ == "__main__":
    main()
