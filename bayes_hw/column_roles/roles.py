"""Which columns of a log are command and output: the pair that names and numbers speak for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bayes_hw.column_roles.column_facts import FEWEST_NUMBERS, ColumnFacts, moves
from bayes_hw.following import following, relation
from bayes_hw.formats.header import split_name
from bayes_hw.reading_options import ReadingOptions

MOST_COLUMNS = 24
"""Columns that are compared with each other."""

COMMAND_WORDS = (
    *("cmd", "command", "demand", "dem", "setpoint", "set", "target", "ref", "reference", "input", "desired"),
    *("commanded", "vir", "voltage", "soll"),
)

OUTPUT_WORDS = (
    *(
        "actual",
        "act",
        "meas",
        "measured",
        "enc",
        "encoder",
        "angle",
        "output",
        "pos",
        "position",
        "az",
        "el",
    ),
    *("feedback", "fb", "istw", "ist_", "_ist"),
)

SPEED_WORDS = ("vel", "rate", "speed")

NAME_BONUS = 0.3

AMBIGUOUS = NAME_BONUS
"""A pair that follows is no rival only where a name more, or as much of the numbers, speaks against it."""

FOLLOWS = 0.5

RELATED = {"follows": 1.0, "inverted": 1.0, "derivative": 0.8}
"""What a correlation counts where the angle is so related to the command; an output that is a speed moves as
a derivative."""

POSITION_GAINS = (0.1, 3.0)
"""Output speed over the speed of a command that is a position."""


class Pair(NamedTuple):
    """Two columns as command and output: how far numbers and names speak for it, and whether the command is
    then a position."""

    command: str
    output: str
    numbers: float
    names: float
    is_position: bool

    @property
    def score(self) -> float:
        return self.numbers + self.names


def roles_of(
    facts: Sequence[ColumnFacts],
    rate: float,
    options: ReadingOptions,
    command: str | None,
    output: str | None,
) -> tuple[ReadingOptions, list[str], list[str]]:
    """Command and output among the columns: the pair that names and numbers speak for, or the one that is
    named with its like; two that are named are taken as they are."""
    usable = [each for each in facts if moves(each)][:MOST_COLUMNS]
    names = {each.name: each for each in usable}
    bare = {split_name(name)[0]: name for name in names}
    inputs = [bare.get(command, command)] if command else list(names)
    outputs = [bare.get(output, output)] if output else list(names)
    pairs = [
        _pair(names[u], names[y], rate)
        for u in inputs
        for y in outputs
        if u in names and y in names and u != y
    ]
    best = max(pairs, key=lambda pair: pair.score, default=None)
    both_named = command is not None and output is not None
    if best is None or (best.score < FOLLOWS and not both_named):
        return options, [], [_no_pair(facts, list(names))]
    rival = _rival(best, pairs)
    if rival is not None:
        return options, [], [_asked(best, rival)]
    u, y, is_position = best.command, best.output, best.is_position
    word = _chosen_words(names[u], names[y], rate, is_position)
    columns = replace(
        options.columns, input="u" if is_position else split_name(u)[0], output=split_name(y)[0]
    )
    chosen = replace(options, columns=columns, input_position=split_name(u)[0] if is_position else None)
    return chosen, [word], []


def _no_pair(facts: Sequence[ColumnFacts], moving: Sequence[str]) -> str:
    """What is asked where no two columns are command and output."""
    still = [each for each in facts if each.name not in moving]
    words = [f"{each.name!r} {_why_still(each)}" for each in still[:4]]
    if len(moving) == 1:
        words.append(f"{moving[0]!r} alone moves")
        remedy = "where the other signal is in another file, give --join FILE and --input NAME, --output NAME"
    elif moving:
        words.append("no output follows a command clearly")
        remedy = f"give --input NAME and --output NAME, of {', '.join(map(repr, moving))}"
    elif any(0 < np.isfinite(each.values).sum() <= FEWEST_NUMBERS for each in still):
        remedy = "give --input NAME and --output NAME"
    else:
        remedy = "give a log of an axis that moves"
    if not words:
        return "which columns are command and output? several have the same name: give each one of its own"
    return f"which columns are command and output? {'; '.join(words)}: {remedy}"


def _why_still(facts: ColumnFacts) -> str:
    shown = facts.values[np.isfinite(facts.values)]
    if len(shown) == 0:
        return "is text or empty"
    if np.ptp(shown) == 0:
        return f"is {shown[0]:.6g} throughout"
    return f"has {len(shown)} numbers, too few"


def _chosen_words(u: ColumnFacts, y: ColumnFacts, rate: float, is_position: bool) -> str:
    """The pair taken, and how far its numbers speak for it."""
    length = min(len(u.values), len(y.values))
    command, angle = u.motion(length), y.motion(length)
    if is_position:
        command, angle = np.diff(command) * rate, angle[:-1]
    found = following(command, angle, rate)
    how = "a position" if is_position else "a velocity"
    size = 0.0 if found is None else found.correlation
    gain = "" if found is None or not found.is_clear else f" and is {found.gain:.2g} times it, unit for unit"
    said = f"command: {u.name!r}, {how}; output: {y.name!r}; its speed follows with correlation {size:.2f}"
    by_name = "" if abs(size) > FOLLOWS else ", so by their names alone"
    return said + gain + by_name


def _pair(u: ColumnFacts, y: ColumnFacts, rate: float) -> Pair:
    """How well `y` follows `u`, by numbers and names, and whether `u` is then a position."""
    length = min(len(u.values), len(y.values))
    command, angle = u.motion(length), y.motion(length)
    names = NAME_BONUS * (_has(u.name, COMMAND_WORDS, "u") + _has(y.name, OUTPUT_WORDS, "y"))
    names -= NAME_BONUS * (_has(u.name, OUTPUT_WORDS, "y") * (1 - _has(u.name, COMMAND_WORDS, "u")))
    names -= NAME_BONUS * _has(y.name, COMMAND_WORDS, "u")
    forward = following(command, angle, rate)
    related = relation(command, angle, rate)
    speed = 0.0 if forward is None else RELATED.get(related, 0.0) * forward.correlation
    of_speed = following(np.diff(command) * rate, angle[:-1], rate) if related == "derivative" else None
    is_position = (
        of_speed is not None and of_speed.is_forward and POSITION_GAINS[0] < of_speed.gain < POSITION_GAINS[1]
    )
    same = 0.0 if of_speed is None or not is_position else of_speed.correlation
    if any(word in u.name.casefold() for word in SPEED_WORDS):
        names += NAME_BONUS / 2
    if any(word in y.name.casefold() for word in SPEED_WORDS):
        names -= NAME_BONUS
    if is_position and not _has(u.name, COMMAND_WORDS, "u"):
        names -= NAME_BONUS
    return Pair(u.name, y.name, max(same if is_position else 0.0, speed), names, is_position)


def _rival(best: Pair, pairs: Sequence[Pair]) -> Pair | None:
    """Another pair that may be meant: one that follows and of which names say as much, or that of another
    axis, whose output does not follow this command. That the two are swapped is found in the record."""
    turned = (best.output, best.command)
    following_too = [
        pair
        for pair in pairs
        if pair is not best and pair.numbers > FOLLOWS and (pair.command, pair.output) != turned
    ]
    of_this = {pair.output for pair in following_too if pair.command == best.command}
    for pair in sorted(following_too, key=lambda pair: -pair.score):
        is_apart = not {pair.command, pair.output} & {best.command, best.output, *of_this}
        if is_apart or pair.score > best.score - AMBIGUOUS:
            return pair
    return None


def _asked(best: Pair, rival: Pair) -> str:
    """The question between two pairs, by the one option that answers it."""
    if rival.output != best.output:
        return (
            f"which column? give --output {best.output!r} or --output {rival.output!r}: both follow a command"
        )
    if best.is_position != rival.is_position:
        one, two = (
            f"--input{'-position' if pair.is_position else ''} {pair.command!r}" for pair in (best, rival)
        )
        return f"is the command velocity or position? give {one} or {two}"
    return (
        f"which column? both are followed alike: give --input {best.command!r} or --input {rival.command!r}"
    )


def _has(name: str, words: Sequence[str], letter: str) -> bool:
    bare = split_name(name)[0].casefold()
    return bare == letter or any(word in bare for word in words)
