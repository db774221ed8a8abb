"""Which labels the records leave open."""

from __future__ import annotations

from collections.abc import Mapping


def confusable_pairs(
    answer: tuple[str, ...], scores: Mapping[tuple[str, ...], float], least: float
) -> list[tuple[str, str]]:
    """Pairs (named, rival) where putting the rival in place of the named label costs no more than `least`."""
    if not answer or answer == ("other",) or answer not in scores:
        return []
    found = []
    for labels, value in scores.items():
        if len(labels) != len(answer) or scores[answer] - value > least:
            continue
        named, rivals = set(answer) - set(labels), set(labels) - set(answer)
        if len(named) == 1:
            found.append((named.pop(), rivals.pop()))
    return found
