"""One verdict a parameter, with the numbers behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from bayes_hw.identifiability.prior_sensitivity import SENSITIVE, PowerScaling
from bayes_hw.identifiability.profile import REACH, THRESHOLD, Profile
from bayes_hw.infer.posterior import PRIOR_DOMINATED_BELOW

Verdict: TypeAlias = Literal["identified", "weakly identified", "prior-dominated", "exactly flat"]

FLAT_SHARE = 0.01
"""A parameter is exactly flat when at least this length of its direction lies in the null space."""

STRONG_CONTRACTION = 0.9
"""A contraction below this is weak."""

SEEN_FALL = 0.005
"""A fall of the log-likelihood below this is none that its evaluation could be trusted with."""

RULES = (
    f"exactly flat: at least {FLAT_SHARE:g} of the parameter's direction lies in the null space of the"
    " structure",
    f"prior-dominated: contraction below {PRIOR_DOMINATED_BELOW:g}, or the profile log-likelihood does not"
    f" fall by {THRESHOLD:g} on one side within {REACH:g} prior standard deviations, or falls there only"
    " because another parameter stands at its bound",
    f"weakly identified: contraction below {STRONG_CONTRACTION:g}, or sensitivity to the prior of"
    f" {SENSITIVE:g} or more, or a half width that may as well be zero",
    "identified: everything else",
)
"""The rules in the order in which they are asked."""


@dataclass(frozen=True)
class ParameterVerdict:
    """What the records tell of one parameter, and why; None where a number was not computed."""

    name: str
    verdict: Verdict
    reason: str
    contraction: float | None = None
    flat_share: float | None = None
    prior_sensitivity: float | None = None
    likelihood_sensitivity: float | None = None
    lower_side: str | None = None
    upper_side: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return dict(vars(self))


def flat_verdicts(names: Sequence[str], flat_share: Mapping[str, float]) -> tuple[ParameterVerdict, ...]:
    """Verdicts of those parameters, all gains free, that are exactly flat."""
    return tuple(
        ParameterVerdict(
            name,
            "exactly flat",
            f"{flat_share[name]:.2f} of its direction is flat (threshold {FLAT_SHARE:g})",
            flat_share=flat_share[name],
        )
        for name in names
        if flat_share[name] >= FLAT_SHARE
    )


def verdict_on(
    name: str,
    contraction: float,
    profile: Profile | None = None,
    scaling: PowerScaling | None = None,
) -> ParameterVerdict:
    """The verdict on a parameter that no symmetry makes flat."""
    verdict, reason = _decide(contraction, profile, scaling)
    return ParameterVerdict(
        name,
        verdict,
        reason,
        contraction=contraction,
        prior_sensitivity=scaling.prior if scaling else None,
        likelihood_sensitivity=scaling.likelihood if scaling else None,
        lower_side=profile.lower if profile else None,
        upper_side=profile.upper if profile else None,
    )


def _decide(contraction: float, profile: Profile | None, scaling: PowerScaling | None) -> tuple[Verdict, str]:
    contracted = f"contraction {contraction:.3g}"
    sides = () if profile is None else (("below", profile.lower), ("above", profile.upper))
    for place, side in sides:
        assert profile is not None
        if side == "open":
            fall = profile.fall(place == "above")
            falls = f"falls by {fall:.2g} at most" if fall >= SEEN_FALL else "was not seen to fall"
            return "prior-dominated", (
                f"{place} the estimate the log-likelihood {falls} (threshold {THRESHOLD:g}); {contracted}"
            )
        if side == "falls at a bound":
            return "prior-dominated", (
                f"{place} the estimate the likelihood falls only with"
                f" {profile.bound_partner(place == 'above')} at its bound; {contracted}"
            )
    if contraction < PRIOR_DOMINATED_BELOW:
        return "prior-dominated", f"{contracted} (threshold {PRIOR_DOMINATED_BELOW:g})"
    if contraction < STRONG_CONTRACTION:
        return "weakly identified", f"{contracted} (threshold {STRONG_CONTRACTION:g})"
    if scaling is not None and scaling.prior >= SENSITIVE:
        return "weakly identified", f"sensitivity to the prior {scaling.prior:.2g} (threshold {SENSITIVE:g})"
    if profile is not None and profile.lower == "zero":
        return (
            "weakly identified",
            f"may as well be zero: only its upper side falls by {THRESHOLD:g}; {contracted}",
        )
    return "identified", contracted
