"""What do these records show, before any model?"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bayes_hw.entrance import check_whole
from bayes_hw.first_look import look as first_look
from bayes_hw.interface.arguments import records_given
from bayes_hw.interface.doors import warn_of
from bayes_hw.python_words import in_python
from bayes_hw.record import Record
from bayes_hw.report.look import page


@dataclass(frozen=True, eq=False)
class SeenRecords:
    """What records show; `look` holds the measures as arrays."""

    look: first_look.Look

    def to_dict(self) -> dict[str, Any]:
        """The content of look.json."""
        return self.look.to_dict()

    def __str__(self) -> str:
        """The finding in words, and what to record next."""
        return str(self.look.advice)

    def __repr__(self) -> str:
        return f"SeenRecords({len(self.look.records)} records, {self.look.duration_s:g} s)"

    def _repr_html_(self) -> str:
        return page.first_screen(self.look)

    def write(self, folder: Path | str, title: str = "") -> None:
        """look.json and report.html, both or neither, as `bayes-hw look` writes them."""
        page.write(self.look, Path(folder), title)


def look(records: Record | Sequence[Record], *, accept: Collection[str] = ()) -> SeenRecords:
    """What `records` of one axis show, no model needed; as `bayes-hw look`.

    Raises InputError on arguments that are no records, on records that differ in rate or units, and on one
    that is not what it is said to be, such as a "swapped" one, unless `accept` names that.
    """
    given = records_given(records)
    with in_python():
        warn_of(sentence for record in given for sentence in check_whole(record, accept))
    return SeenRecords(first_look.look(given))
