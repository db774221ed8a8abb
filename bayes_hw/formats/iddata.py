"""Records from MATLAB's `iddata`, exported as a structure (`s = get(data)`, or with the same field names).

Read are OutputData (or y), InputData (or u), OutputUnit, InputUnit, Ts, Tstart, SamplingInstants and
TimeUnit. Source: MathWorks, System Identification Toolbox, "iddata".
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.matlab_structures import Structure, Value, read_structures
from bayes_hw.formats.table import Table, stated_unit

OUTPUT, INPUT = ("OutputData", "y"), ("InputData", "u")
SECONDS = ("", "s", "sec", "second", "seconds")


def read_iddata(path: Path, names: Sequence[str], *, most_rows: int) -> Table | None:
    """Time, input and output of the file's one iddata structure under these three `names`.

    None where the file holds no such structure. Raises InputError, naming structure and field, where it holds
    several, or one that is not the record of one input and one output with times in seconds.
    """
    found = [structure for structure in read_structures(path) if _is_iddata(structure)]
    if not found:
        return None
    if len(found) > 1:
        listed, first = ", ".join(structure.name for structure in found), found[0].name
        raise InputError(
            f"{path}: holds {len(found)} iddata structures ({listed}); save one alone, or name the columns: "
            f"--input {first}.InputData --output {first}.OutputData --time none --sample-rate HZ"
        )
    structure = found[0]
    _check_time_unit(structure)
    u, y = (_column(structure, names_of, most_rows) for names_of in (INPUT, OUTPUT))
    values = dict(zip(names, (_times(structure, len(y), most_rows), u, y), strict=True))
    return Table(
        values,
        (),
        tuple(f"{structure.name}.{field}" for field in structure.fields),
        "variable",
        lambda index: f"sample {index + 1}",
        _units(structure, names),
    )


def _units(structure: Structure, names: Sequence[str]) -> dict[str, str]:
    """The units of input and output under the last two of `names`, as far as they are stated."""
    found = {}
    for name, field in zip(names[1:], ("InputUnit", "OutputUnit"), strict=True):
        value: Value = structure.value(field, 16) if field in structure else ""
        if isinstance(value, list) and len(value) == 1:
            (value,) = value
        unit = stated_unit(value)
        if unit is not None:
            found[name] = unit
    return found


def _is_iddata(structure: Structure) -> bool:
    has = [any(name in structure for name in names) for names in (OUTPUT, INPUT)]
    return all(has) and ("Ts" in structure or "SamplingInstants" in structure)


def _column(structure: Structure, names: tuple[str, str], most_rows: int) -> FloatArray:
    """The numbers under the first of two names that holds any."""
    for name in names:
        if name not in structure:
            continue
        value = structure.value(name, 2 * most_rows)
        if isinstance(value, str):
            continue
        if isinstance(value, list):
            raise _refusal(
                structure, name, f"holds {len(value)} experiments; export one, such as getexp(data, 1)"
            )
        if isinstance(value, dict):
            raise _refusal(structure, name, "holds a structure; give a column of numbers")
        if value.ndim != 2 or min(value.shape) != 1:
            shape = " x ".join(map(str, value.shape))
            raise _refusal(structure, name, f"is {shape}; export one input and one output")
        if np.isinf(value).any():
            first = int(np.flatnonzero(np.isinf(value.ravel()))[0])
            raise _refusal(
                structure, name, f"sample {first + 1} is not a finite number; correct or remove it"
            )
        return value.ravel()[:most_rows]
    raise _refusal(structure, names[0], "holds no numbers; export OutputData and InputData")


def _times(structure: Structure, samples: int, most_rows: int) -> FloatArray:
    """Stamps in s: Tstart + k Ts, or SamplingInstants where there is no Ts."""
    period = _scalar(structure, "Ts")
    if period is not None:
        if not period > 0:
            raise _refusal(structure, "Ts", f"is {period:g}; give a positive sample time in s")
        start = _scalar(structure, "Tstart")
        with np.errstate(over="ignore"):
            stamps = (period if start is None else start) + period * np.arange(samples, dtype=np.float64)
        if not np.isfinite(stamps).all():
            raise _refusal(structure, "Ts", f"is {period:g}; give the sample time in s")
        return stamps
    if "SamplingInstants" in structure:
        instants = structure.value("SamplingInstants", 2 * most_rows)
        if isinstance(instants, np.ndarray) and instants.size and np.isfinite(instants).all():
            return instants.ravel()[:most_rows]
    raise _refusal(structure, "Ts", "is empty; give the sample time in s")


def _scalar(structure: Structure, field: str) -> float | None:
    """The number in `field`, None where it is absent or empty."""
    if field not in structure:
        return None
    value = structure.value(field, 16)
    if isinstance(value, np.ndarray) and value.size == 0:
        return None
    if not isinstance(value, np.ndarray) or value.size != 1 or not np.isfinite(value).all():
        raise _refusal(structure, field, "is not one finite number; export one experiment")
    return float(value.ravel()[0])


def _check_time_unit(structure: Structure) -> None:
    unit: Value = structure.value("TimeUnit", 16) if "TimeUnit" in structure else ""
    if not isinstance(unit, str) or unit.strip().lower() not in SECONDS:
        shown = repr(unit[:40]) if isinstance(unit, str) else "not text"
        raise _refusal(structure, "TimeUnit", f"is {shown}; export with times in seconds")


def _refusal(structure: Structure, field: str, said: str) -> InputError:
    return InputError(f"{structure.path}: {structure.name}.{field} {said}")
