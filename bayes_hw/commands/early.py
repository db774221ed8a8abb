"""Bad input refused before what computes is imported, which takes seconds."""

from __future__ import annotations

import argparse
import json
from contextlib import suppress
from pathlib import Path

from bayes_hw.errors import InputError

ALONE = ("simulate", "predict")
"""Commands that take a command without any output."""


def refuse_early(parsed: argparse.Namespace) -> None:
    """Raise InputError where a record or model that `parsed` names cannot be used.

    Records are kept in `parsed.read_already`, so that the command does not read them again.
    """
    model = getattr(parsed, "model", None)
    content: object = None
    if isinstance(model, str) and not model.lower().endswith(".mat"):
        from bayes_hw.model.model_file import load_model_json

        content = load_model_json(Path(model))
    if "time" not in parsed:
        return
    paths = _records(parsed)
    if not paths:
        return
    from bayes_hw.commands.inputs import in_units, is_compared, read_once, reading_options, refuse_faults
    from bayes_hw.record import Units

    options = reading_options(parsed, needs_output=parsed.command not in ALONE)
    parsed.read_already = {}
    stated = content.get("units") if isinstance(content, dict) else None
    units = None
    with suppress(InputError):  # which reading the model will say
        units = Units.from_dict(stated) if isinstance(stated, dict) else None
    for path in paths:
        for record in read_once(parsed, path, options):
            held = record if units is None else in_units(record, units)
            refuse_faults(held, parsed.accept, alone=not is_compared(parsed))


def _records(parsed: argparse.Namespace) -> list[str]:
    from bayes_hw.commands.inputs import case_folder

    if parsed.command == "convert":
        return []
    named = [getattr(parsed, "record", None), *getattr(parsed, "records", []), *getattr(parsed, "train", [])]
    named += getattr(parsed, "holdout", [])
    paths = [path for path in named if isinstance(path, str)]
    folder = case_folder(parsed)
    if folder is not None:
        return paths + _records_of_case(Path(folder))
    return paths + [path for path in getattr(parsed, "case", None) or [] if isinstance(path, str)]


def _records_of_case(folder: Path) -> list[str]:
    """The records that a case.json names; none where it cannot be read, which the command says."""
    try:
        data = json.loads((folder / "case.json").read_text(encoding="utf-8"))
        names = [*data["train"], *data["holdout"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []
    return [str(folder / name) for name in names if isinstance(name, str)]
