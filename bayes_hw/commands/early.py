"""Bad input refused before what computes is imported, which takes seconds."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path

from bayes_hw.errors import InputError

ALONE = ("simulate", "predict")
"""Commands that take a command without any output."""

GIVE_A_POSTERIOR = "give the --out folder of `bayes-hw sample`, `report` or `diagnose`"
POSTERIORS = ("posterior.nc", "corrected.json", "verdict.json")
"""One of these is in a folder that --posterior may name; a file that is named stands for its folder, or is a
corrected.json."""


def refuse_early(parsed: argparse.Namespace) -> None:
    """Raise InputError where a model, posterior, case or record that `parsed` names cannot be used.

    Records are kept in `parsed.read_already`, so that the command does not read them again. Those of a
    simulator of the user's are left to the command: in which units they are it alone says.
    """
    if getattr(parsed, "simulator", None) is not None:
        return
    model = getattr(parsed, "model", None)
    content: object = None
    if isinstance(model, str) and not model.lower().endswith(".mat"):
        from bayes_hw.files import GIVE_A_MODEL, read_json

        content = read_json(Path(model), GIVE_A_MODEL)
    posterior = getattr(parsed, "posterior", None)
    if isinstance(posterior, str):
        parsed.posterior = _posterior_place(Path(posterior))
    if "time" not in parsed or parsed.command == "convert":
        return
    fitted, held_out = _paths(parsed)
    if not fitted and not held_out:
        return
    from bayes_hw.commands.inputs import (
        in_units,
        is_compared,
        is_simulated,
        read_once,
        reading_options,
        refuse_faults,
    )
    from bayes_hw.entrance import check_rate, check_repeats, check_scale, check_signs, has_rate
    from bayes_hw.record import Units

    options = reading_options(parsed, needs_output=parsed.command not in ALONE)
    parsed.read_already = {}
    stated = content.get("units") if isinstance(content, dict) else None
    units = None
    with suppress(InputError):  # which reading the model will say
        units = Units.from_dict(stated) if isinstance(stated, dict) else None
    groups = []
    for paths in (fitted, held_out):
        records = [record for path in paths for record in read_once(parsed, path, options)]
        records = records if units is None else [in_units(record, units) for record in records]
        for record in records:
            refuse_faults(record, parsed.accept, alone=not is_compared(parsed), later=is_simulated(parsed))
        groups.append(records)
    if parsed.command != "look":
        check_repeats(*groups)
    check_signs([*groups[0], *groups[1]])
    rate_hz = content.get("sample_rate_hz") if isinstance(content, dict) else None
    if isinstance(rate_hz, int | float) and rate_hz > 0:
        others = [record for record in (*groups[0], *groups[1]) if not has_rate(record, rate_hz)]
        for record in others if "scale" not in parsed.accept else ():
            check_scale(record)
        for record in others:
            check_rate(record, rate_hz, "the model")


def _posterior_place(given: Path) -> str:
    """The folder of a posterior, or a corrected.json; raises InputError where `given` is neither."""
    if given.is_file():
        from bayes_hw.files import read_json

        content = read_json(given, GIVE_A_POSTERIOR) if given.suffix.lower() == ".json" else None
        if isinstance(content, dict) and "effects" in content:
            return str(given)
        given = given.parent
    if not any((given / name).is_file() for name in POSTERIORS):
        raise InputError(f"{given / POSTERIORS[0]}: missing; {GIVE_A_POSTERIOR}")
    return str(given)


def _paths(parsed: argparse.Namespace) -> tuple[list[str], list[str]]:
    """The records that are fitted to, and those held out."""
    from bayes_hw.commands.inputs import case_folder

    folder = case_folder(parsed)
    if folder is not None:
        from bayes_hw.gap.case.case_file import read_case_file

        named = read_case_file(Path(folder))
        return [str(path) for path in named.train], [str(path) for path in named.holdout]
    roles = ("record", "records", "train", "case")
    given = [getattr(parsed, role, None) or [] for role in roles]
    fitted = [path for each in given for path in ([each] if isinstance(each, str) else each)]
    return fitted, list(getattr(parsed, "holdout", None) or [])
