"""What the decision on one case rests on, kept so that it can be made again with other constants."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.files import write_json
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.answer.decide import best_of_sets, claims_of, remains_of
from bayes_hw.gap.answer.judgement import Claim, Judgement, Labels, Remains, choose_labels, judge
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.criticism.block_functions import block_negative_log_p
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic, residual_diagnostics
from bayes_hw.gap.diagnosis import Diagnosis, diagnose
from bayes_hw.gap.fit.explanation import is_far_ahead

BALLOT = "ballot.json"

WIDEST = 2.0
"""Factor by which a demand on a pair may be eased and the pair still be on the ballot."""

SINGLES, PAIRS = 2, 3
"""How many of the best have what they leave on the ballot."""


@dataclass(frozen=True)
class Ballot:
    """The `claims` of all sets of labels, what the foremost of them leave, and the `labels` in question."""

    claims: Mapping[Labels, Claim]
    remains: Mapping[Labels, Remains]
    labels: tuple[str, ...]

    def judge(self, calibration: Calibration) -> Judgement:
        """The judgement by these constants; sets whose leftovers are not known are not chosen."""
        known = {
            labels: claim if len(labels) < 2 or labels in self.remains else replace(claim, possible=False)
            for labels, claim in self.claims.items()
        }
        chosen, scores = choose_labels(known, calibration)
        return judge(chosen, scores, self.remains[chosen], self.labels, calibration)

    def to_dict(self) -> dict[str, Any]:
        """For ballot.json."""
        return {
            "claims": [[list(labels), asdict(claim)] for labels, claim in self.claims.items()],
            "remains": [[list(labels), asdict(remains)] for labels, remains in self.remains.items()],
            "labels": list(self.labels),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Ballot:
        """As `to_dict` gives it."""
        return cls(
            {tuple(labels): _claim(claim) for labels, claim in content["claims"]},
            {tuple(labels): _remains(remains) for labels, remains in content["remains"]},
            tuple(content["labels"]),
        )

    @classmethod
    def read(cls, folder: Path) -> Ballot:
        """OUT/CASE/ballot.json."""
        return cls.from_dict(json.loads((folder / BALLOT).read_text(encoding="utf-8")))


def _claim(content: Mapping[str, Any]) -> Claim:
    demands = tuple((str(name), float(value)) for name, value in content["demands"])
    return Claim(float(content["score"]), bool(content["possible"]), demands)


def _remains(content: Mapping[str, Any]) -> Remains:
    left = tuple(ResidualDiagnostic(**item) for item in content["leftovers"])
    return Remains(**{**content, "leftovers": left, "named": tuple(content["named"])})


def ballot_of(diagnosis: Diagnosis, labels: Sequence[str], calibration: Calibration) -> Ballot:
    """The ballot of a finished diagnosis: what it chose, no effect, and the best singles and pairs."""
    attribution = diagnosis.attribution
    best = best_of_sets(attribution)
    claims = claims_of(best, diagnosis.case.model.noise_sigma, calibration)
    eased = _eased(calibration)
    order = sorted(best, key=lambda labels: -claims[labels].score)
    foremost = [(), diagnosis.decision.explanation.labels]
    foremost += [labels for labels in order if len(labels) == 1][:SINGLES]
    foremost += [labels for labels in order if len(labels) == 2 and claims[labels].earned(eased)][:PAIRS]
    inputs, stated = [record.u for record in diagnosis.case.train], diagnosis.case.model.noise_sigma
    ahead = is_far_ahead(attribution.explanations)
    with np.errstate(all="ignore"):
        negative_log_p = block_negative_log_p(attribution.base.fit, inputs)
        left = {
            key: _small(residual_diagnostics(best[key], inputs, stated)) for key in dict.fromkeys(foremost)
        }
    remains = {
        key: remains_of(attribution.base, best[key], its, negative_log_p, ahead) for key, its in left.items()
    }
    finite = {labels: claim for labels, claim in claims.items() if np.isfinite(claim.score)}
    return Ballot(finite, remains, tuple(labels))


def _small(left: Sequence[ResidualDiagnostic]) -> list[ResidualDiagnostic]:
    """Those that can make a difference."""
    return [item for item in left if item.negative_log_p > 0 and item.size > 0]


def _eased(calibration: Calibration) -> Calibration:
    names = ("pair_gain", "pair_size", "pair_share", "slow_pair_size", "slow_pair_share")
    return replace(calibration, **{name: getattr(calibration, name) / WIDEST for name in names})


def diagnose_with_ballot(folder: Path, out: Path, seed: int, *, jobs: int = 1, without: str = "") -> None:
    """By its drive train alone, base parameters as the posteriors state them; writes OUT/ballot.json too.

    `without` names labels to leave out of the catalogue, joined by commas.
    """
    calibration = Calibration.built_in().with_posteriors_as_they_are()
    left_out, rng = frozenset(without.split(",")) - {""}, np.random.default_rng(seed)
    diagnosis = diagnose(Case.read(folder), rng, jobs=jobs, without=left_out, calibration=calibration)
    diagnosis.write(out)
    labels = [name for name in diagnosis.verdict.probability if name not in ("none", "other")]
    ballot = ballot_of(diagnosis, labels, calibration)
    write_json(out / BALLOT, ballot.to_dict(), None)
