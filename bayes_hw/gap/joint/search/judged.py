"""Paths at their ends: without labels that are not worth enough, and by the likelier cause of their noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.hidden_zone import likelier_cause
from bayes_hw.gap.joint.search.verification import verified
from bayes_hw.phrases import log_evidence
from bayes_hw.record import Record


@dataclass(frozen=True, eq=False)
class Judged:
    """A path as it stands, and the nats of its labels; where its noise has a cause, the path by each of both,
    and what the nats of the one that is not likelier alone come to over the base."""

    path: FollowedPath
    nats: Mapping[str, float]
    caused: tuple[FollowedPath, ...] = ()
    less_likely: Mapping[str, float] = field(default_factory=dict)


def judged(
    paths: Sequence[FollowedPath],
    others: Sequence[JointFit],
    whole: Sequence[Record],
    told: Callable[[str], None],
) -> dict[FollowedPath, Judged]:
    """Those of the paths that may explain most: one that explains no more as it is than another one that is
    judged need not be, unless its noise has a cause, which gains by its exact likelihood. Of `others` any may
    do better than a label (see `verified`); of the `whole` records part may be left out of the fits.
    """
    found: dict[FollowedPath, Judged] = {}
    most = -np.inf
    for path in sorted(paths, key=lambda path: -path.gained):
        if path.gained <= most and path.fit.response.cause is None:
            continue
        found[path] = _judged(path, others, whole, told)
        most = max(most, found[path].path.gained)
    return found


def _judged(
    path: FollowedPath, others: Sequence[JointFit], whole: Sequence[Record], told: Callable[[str], None]
) -> Judged:
    fit, nats = verified(path.fit, path.base, others, path.readings, told)
    path = replace(path, fit=fit)
    if fit.response.cause is None:
        return Judged(path, nats)
    likelier, lead, fits = likelier_cause(fit, whole)
    told(f"{likelier.added[-1]} leads by {log_evidence(lead)}")
    more = likelier.score - fit.score
    named = dict(zip(fit.labels, likelier.labels, strict=True))
    best = replace(path, fit=likelier)
    return Judged(
        best,
        {named[label]: value + more for label, value in nats.items()},
        tuple(best if one is likelier else replace(path, fit=one) for one in fits),
        {one.added[-1]: best.gained - lead for one in fits if one is not likelier},
    )
