"""G grown from nothing beside a label that was found: before it was, G made up for it by delay, limits and
poles, and a descent from there gives none of them back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bayes_hw.gap.joint.fit.base_cascade import grown_base
from bayes_hw.gap.joint.residuals.remainder import leaves_a_cause
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.rival_paths import begun_over
from bayes_hw.identify.experiment import white_noise_level
from bayes_hw.time_budget import time_is_up

Follow = Callable[[FollowedPath], FollowedPath]


def with_leading_grown_anew(paths: list[FollowedPath], follow: Follow) -> list[FollowedPath]:
    """The paths, the leading one over a G grown anew where it leaves something and that gains more."""
    leading = max(paths, key=lambda path: path.gained, default=None)
    if leading is None or time_is_up() or not _leaves_something(leading):
        return paths
    begun = over_grown_anew(leading)
    if begun is None:
        return paths
    better = max(follow(begun), leading, key=lambda path: path.gained)
    return [better if path is leading else path for path in paths]


def over_grown_anew(path: FollowedPath) -> FollowedPath | None:
    """The label that a path begins with over a G that is grown on its records less what that label does
    there; None where it is no effect that a simulation follows, or where known inputs are part of G."""
    fit, label = path.fit, path.begun_with
    if label not in fit.effect_labels or fit.observer is not None or path.base.values.effects:
        return None
    rest, records = fit.without(label), []
    for number, record in enumerate(fit.response.records):
        whole = fit.response.along(fit.values, number).y
        records.append(replace(record, y=record.y - whole + rest.response.along(rest.values, number).y))
    grown = grown_base(records, white_noise_level([record.y_or_nan for record in records]))
    bare = path.base.moved(grown.structure, JointValues(grown.values.cascade))
    begun = begun_over(bare, label)
    return None if begun is None else replace(path, fit=begun.descended(), settled=False)


def _leaves_something(path: FollowedPath) -> bool:
    return path.fit.response.cause is not None or leaves_a_cause(path.fit)
