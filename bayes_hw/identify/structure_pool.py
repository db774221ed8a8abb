"""The structures that a search visited, with their weights: what the choice of one of them rests on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bayes_hw.identify.growth.search import Grown
from bayes_hw.phrases import in_percent

LISTED = 12
"""Members kept, the heaviest first, and the chosen one."""


@dataclass(frozen=True)
class Kept:
    """Real poles kept although the criterion asks for none: slow ones, which the dead zone would be taken
    for (`growth.slow_poles`), and fast ones at the onset, which resonances would be moved for
    (`growth.onset`)."""

    slow: int = 0
    onset: int = 0


NOTHING = Kept()


@dataclass(frozen=True)
class Member:
    """One fitted structure: its order, delay, integrator and static blocks, how many slow and onset poles
    were added to what the criterion asked for, log-likelihood, free parameters, and its weight in the pool.
    """

    order: int
    delay_samples: int
    integrator: bool
    blocks: tuple[str, ...]
    slow_poles_added: int
    onset_poles_added: int
    log_likelihood: float
    parameters: int
    weight: float
    chosen: bool


LEAST_SAID = 1e-3
"""A weight that is said: one of a structure with poles that the weights frown at says nothing of it."""


@dataclass(frozen=True)
class StructurePool:
    """The heaviest structures; weights exp(log-likelihood - parameters) of all that were visited, their sum
    one (Burnham and Anderson, Model Selection and Multimodel Inference, sec. 2.9)."""

    members: tuple[Member, ...]
    visited: int

    @property
    def chosen(self) -> Member:
        return next(member for member in self.members if member.chosen)

    @property
    def sentence(self) -> str:
        """What was chosen, and what speaks for the others."""
        one = self.chosen
        said = (
            f"{self.visited} structures of G were fitted; the one of order {one.order} with a delay of "
            f"{one.delay_samples} samples is taken"
        )
        heaviest = self.members[0]
        if one.weight >= LEAST_SAID:
            said += f", which holds {in_percent(one.weight)} of their weights"
        if not heaviest.chosen:
            share = in_percent(heaviest.weight)
            said += f" (most weight, {share}, has order {heaviest.order}, delay {heaviest.delay_samples})"
        if one.slow_poles_added:
            said += (
                f"; {one.slow_poles_added} slow real poles in it are kept because the evidence cannot "
                "exclude them: without them the dead zone would take up their travel"
            )
        if one.onset_poles_added:
            said += (
                f"; {one.onset_poles_added} fast real poles in it, and a sample less of delay where there is "
                "one, leave the beginning of the impulse response free, which the evidence cannot exclude: "
                "without them the resonances would be taken for known better than they are"
            )
        return said

    @property
    def basis(self) -> str:
        """What intervals of a posterior of the chosen structure rest on."""
        one = self.chosen
        kept = one.slow_poles_added + one.onset_poles_added
        added = (
            f"guarded by {kept} poles that the criterion did not ask for" if kept else "with nothing added"
        )
        return (
            f"the intervals rest on this one structure, {added}; nothing is averaged over the pool, whose "
            "weights tell how firm the choice is"
        )

    def to_dict(self) -> dict[str, Any]:
        """The entry `structure` of fit.json, model.json and posterior.json."""
        return {
            "visited": self.visited,
            "weights": "exp(log-likelihood - parameters), over all structures visited",
            "sentence": self.sentence,
            "basis": self.basis,
            "pool": [asdict(member) | {"blocks": list(member.blocks)} for member in self.members],
        }


def pool_of(tried: Iterable[Grown], chosen: Grown, kept: Kept, factor: int = 1) -> StructurePool:
    """The best fit of every structure among `tried`, and `chosen`, all fitted to the same samples, at a rate
    lower by `factor`; their delays are given in samples of the records."""
    best: dict[tuple[Any, ...], tuple[Grown, Kept]] = {}
    for item, added in [*((item, NOTHING) for item in tried), (chosen, kept)]:
        s = item.structure
        key = s.order, s.delay_samples, s.integrator, blocks_of(item), added
        if key not in best or item.log_likelihood >= best[key][0].log_likelihood:
            best[key] = item, added
    entries = list(best.values())
    logarithms = np.array([item.log_likelihood - item.parameters for item, _ in entries])
    weights = np.exp(logarithms - logarithms.max())
    weights /= weights.sum()
    members = [
        Member(
            item.structure.order,
            factor * item.structure.delay_samples,
            item.structure.integrator,
            blocks_of(item),
            added.slow,
            added.onset,
            float(item.log_likelihood),
            item.parameters,
            float(weight),
            item is chosen,
        )
        for (item, added), weight in zip(entries, weights, strict=True)
    ]
    members.sort(key=lambda member: -member.weight)
    listed = [member for place, member in enumerate(members) if place < LISTED or member.chosen]
    return StructurePool(tuple(listed), len(members))


def blocks_of(item: Grown) -> tuple[str, ...]:
    """Names of the static blocks that a structure has."""
    s = item.structure
    present = (("lower limit", s.lower), ("upper limit", s.upper), ("dead zone", s.dead_zone))
    return tuple(name for name, there in present if there)
