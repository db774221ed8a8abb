"""Which columns of a log are command and output: the pair that names and numbers speak for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.column_roles.column_facts import FEWEST_NUMBERS, ColumnFacts, moves
from bayes_hw.following import following, relation
from bayes_hw.formats.header import split_name
from bayes_hw.reading_options import ReadingOptions

MOST_COLUMNS = 24
"""Columns that are compared with each other."""

COMMAND_WORDS = (
    *("cmd", "command", "demand", "dem", "setpoint", "set", "target", "ref", "reference", "input", "desired"),
    *("commanded", "vir", "voltage"),
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
    *("feedback", "fb"),
)

SPEED_WORDS = ("vel", "rate", "speed")

NAME_BONUS = 0.3

AMBIGUOUS = 0.05

FOLLOWS = 0.5

RELATED = {"follows": 1.0, "inverted": 1.0, "derivative": 0.8}
"""What a correlation counts where the angle is so related to the command; an output that is a speed moves as
a derivative."""

POSITION_GAINS = (0.1, 3.0)
"""Output speed over the speed of a command that is a position."""


def roles_of(
    facts: Sequence[ColumnFacts],
    rate: float,
    options: ReadingOptions,
    command: str | None,
    output: str | None,
) -> tuple[ReadingOptions, list[str], list[str]]:
    """Command and output among the columns: the pair that names and numbers speak for, or the one, or both,
    that are named."""
    usable = [each for each in facts if moves(each)][:MOST_COLUMNS]
    names = {each.name: each for each in usable}
    bare = {split_name(name)[0]: name for name in names}
    inputs = [bare.get(command, command)] if command else list(names)
    outputs = [bare.get(output, output)] if output else list(names)
    scored = sorted(
        (
            (score, is_position, u, y)
            for u in inputs
            for y in outputs
            if u in names and y in names and u != y
            for score, is_position in [_score(names[u], names[y], rate)]
        ),
        reverse=True,
    )
    if not scored or scored[0][0] < FOLLOWS:
        return options, [], [_no_pair(facts, list(names))]
    _, is_position, u, y = best = scored[0]
    rival = next((other for other in scored[1:] if other[0] > best[0] - AMBIGUOUS), None)
    if rival is not None and rival[2:] != (u, y):
        option, one, two = ("--input", u, rival[2]) if rival[2] != u else ("--output", y, rival[3])
        if option == "--input" and is_position != rival[1]:
            one, two = (
                f"--input{'-position' if is_position else ''} {u}",
                f"--input{'-position' if rival[1] else ''} {two}",
            )
            return options, [], [f"is the command velocity or position? give {one} or {two}"]
        return options, [], [f"which column? both follow alike: give {option} {one!r} or {option} {two!r}"]
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


def _score(u: ColumnFacts, y: ColumnFacts, rate: float) -> tuple[float, bool]:
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
    return max(same if is_position else 0.0, speed) + names, is_position


def _has(name: str, words: Sequence[str], letter: str) -> bool:
    bare = split_name(name)[0].casefold()
    return bare == letter or any(word in bare for word in words)
