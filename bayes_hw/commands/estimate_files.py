"""The files of an identified model, and names for those of bands."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from bayes_hw.files import staged, write_json
from bayes_hw.identify.result import Identification, RecordFit
from bayes_hw.record import Record

SEPARATORS = frozenset("/\\:")
"""Characters that set folders and drives apart on one system or another."""

LONGEST_NAME = 200
"""Bytes of a record's name that still fit into the name of a file."""


def band_file_names(records: Sequence[str]) -> list[str]:
    """bands_RECORD.csv for every record, numbered instead where names repeat or are no names of files."""
    usable = all(
        len(os.fsencode(name)) <= LONGEST_NAME and name.isprintable() and not set(name) & SEPARATORS
        for name in records
    )
    if not usable or len(set(records)) < len(records):
        return [f"bands_{number}.csv" for number in range(1, len(records) + 1)]
    return [f"bands_{name}.csv" for name in records]


def write_identification(
    out: Path, identification: Identification, validation: Sequence[RecordFit], records: Sequence[Record]
) -> None:
    """model.json and fit.json, both or neither; both name the records by their digests."""
    origin = {"records": [{"name": record.name, "sha256": record.sha256} for record in records]}
    content = identification.to_dict() | {"validation": [asdict(fit) for fit in validation]} | origin
    model = identification.model.to_dict() | origin | {"structure": identification.pool.to_dict()}
    with staged(out) as place:
        write_json(place / "model.json", model, 2)
        write_json(place / "fit.json", content)
