"""Reading fields of messages from ROS bags and MCAP files, with rosbags (the extra `ros`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.bag_probe import is_sound_bag
from bayes_hw.formats.table import Column, Table

AGAIN = "write it again, with the topics of the record alone"
DEEPEST = 6
MOST_NAMES = 200

MOST_MESSAGE_BYTES = 2**20
"""Of one message: those of a signal are some hundred bytes, images and clouds are more."""

MOST_BYTES = 2**30
"""Of all messages of the topics that are read."""


def rosbags_reader(path: Path) -> ModuleType:
    """rosbags' module of readers; raises InputError that names the extra where it is not installed."""
    try:
        from rosbags import highlevel
    except ImportError:
        raise InputError(
            f"{path}: bags and MCAP files need rosbags; pip install 'bayes-hw[ros]', or export CSV, .mat "
            "or .h5"
        ) from None
    return highlevel


def read_bag(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the fields that `wanted` names, `topic.field` or `topic.field[0]` such as
    `/joint_states.position[0]`.

    Each has the stamps of its messages: those of their header, else those of the log, in ns. Raises
    InputError
    on what is no sound bag, or a field that is no number.
    """
    highlevel = rosbags_reader(path)
    if not is_sound_bag(path):
        raise InputError(f"{path}: is not a sound bag or MCAP file, or inflates beyond all measure; {AGAIN}")
    try:
        with highlevel.AnyReader([path]) as reader:
            return _table(path, reader, wanted, most_rows)
    except InputError:
        raise
    except Exception:
        # rosbags raises errors of its own, of sqlite and of compression on damaged files.
        raise InputError(f"{path}: is not a sound bag or MCAP file; {AGAIN}") from None


def _table(path: Path, reader: Any, wanted: Sequence[str], most_rows: int) -> Table:
    topics = {connection.topic for connection in reader.connections}
    asked: dict[str, tuple[str, str]] = {}
    for name in wanted:
        topic = max((t for t in topics if _begins(name, t)), key=len, default=None)
        if topic is not None:
            asked[name] = (topic, name.removeprefix("/").removeprefix(topic.removeprefix("/")).lstrip(".:"))
    found: dict[str, tuple[list[int], list[float]]] = {name: ([], []) for name in asked}
    names: dict[str, None] = {}
    chosen = [
        each for each in reader.connections if not asked or each.topic in {t for t, _ in asked.values()}
    ]
    seen: set[str] = set()
    total = 0
    for connection, stamp, raw in reader.messages(connections=chosen):
        if not asked and connection.topic in seen:
            continue
        total += len(raw)
        _check_size(path, connection.topic, len(raw), total)
        message = reader.deserialize(raw, connection.msgtype)
        if connection.topic not in seen:
            seen.add(connection.topic)
            names |= dict.fromkeys(f"{connection.topic}.{field}" for field in _fields(message, DEEPEST))
        header = getattr(getattr(message, "header", None), "stamp", None)
        when = stamp if header is None or not header.sec else header.sec * 1_000_000_000 + header.nanosec
        for name, (topic, field) in asked.items():
            if topic == connection.topic and len(found[name][0]) < most_rows:
                found[name][0].append(when)
                found[name][1].append(_number(path, name, message, field))
        if not asked and seen == topics:
            break
    values: dict[str, Column] = {}
    clocks: dict[str, Column] = {}
    for name, (stamps, numbers) in found.items():
        if numbers:
            values[name] = np.array(numbers)
            clocks[name] = np.array(stamps, dtype=np.int64)
    missing = tuple(name for name in wanted if name not in values)
    units = dict.fromkeys(clocks, "ns")
    shown = tuple(names) or tuple(sorted(topics))
    return Table(values, missing, shown, "channel", lambda i: f"message {i + 1}", {}, clocks, units)


def _check_size(path: Path, topic: str, size: int, total: int) -> None:
    """Raise InputError where a message, or all so far, are more than is read."""
    if size > MOST_MESSAGE_BYTES:
        raise InputError(
            f"{path}: a message of {topic!r} has {size / 2**20:.1f} MB, more than the "
            f"{MOST_MESSAGE_BYTES // 2**20} MB of a signal; name a topic of numbers"
        )
    if total > MOST_BYTES:
        raise InputError(
            f"{path}: the messages of the topics asked for take more than {MOST_BYTES // 2**20} MB; "
            "record a shorter bag, or the signal's topic alone"
        )


def _begins(name: str, topic: str) -> bool:
    bare, of = name.removeprefix("/"), topic.removeprefix("/")
    return bare.startswith((f"{of}.", f"{of}:")) or bare == of


def _fields(message: Any, depth: int) -> list[str]:
    """Names of every number in a message."""
    found: list[str] = []
    for name, value in vars(message).items():
        if name.startswith("_") or len(found) > MOST_NAMES:
            continue
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            found.append(name)
        elif isinstance(value, np.ndarray) and value.ndim == 1:
            found += [f"{name}[{i}]" for i in range(min(len(value), 8))]
        elif hasattr(value, "__dict__") and depth and name != "header":
            found += [f"{name}.{inner}" for inner in _fields(value, depth - 1)]
    return found


def _number(path: Path, name: str, message: Any, field: str) -> float:
    value: Any = message
    for part in filter(None, re.split(r"[.\[\]]", field or "data")):
        try:
            value = value[int(part)] if part.isdecimal() else vars(value)[part]
        except (KeyError, IndexError, TypeError):
            fields = ", ".join(_fields(message, DEEPEST)[:12])
            raise InputError(f"{path}: {name!r}: messages have no such field; they have {fields}") from None
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"{path}: {name!r} is no number; name a field of numbers") from None
