"""Units of a record's columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from bayes_hw.errors import InputError, storable_text


@dataclass(frozen=True)
class Units:
    """Units of a record's columns, as text: what goes in comes out in the same unit."""

    time: str = "s"
    input: str = "deg/s"
    output: str = "deg"

    @classmethod
    def from_dict(cls, data: Any) -> Units:
        """Read {"time", "input", "output"}; raises InputError on an unknown key or a value not text."""
        if not isinstance(data, Mapping):
            raise InputError('units: must be an object with "time", "input" and "output"')
        for key, value in data.items():
            if key not in ("time", "input", "output"):
                raise InputError(f'units: unknown key {key!r}; use "time", "input" and "output"')
            if not isinstance(value, str):
                raise InputError(f"units.{key}: must be text")
            storable_text(value, f"units.{key}")
        units = cls(**data)
        if units.time != "s":
            raise InputError(f"units.time: {units.time!r} is not supported; give times in s")
        return units

    def to_dict(self) -> dict[str, str]:
        return asdict(self)

    @property
    def velocity_gain(self) -> str:
        """Unit of output speed over command; brackets around what has a fraction of its own."""
        command = self.input if self.input.isalnum() else f"({self.input})"
        return f"({self.output}/{self.time})/{command}"
