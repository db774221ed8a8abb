"""Models of MATLAB's `idnlhw`, exported as a structure, in and out of model.json's content.

The structure has the fields of the object, so that `s = get(m)` will do once the objects in it are structures
too: InputNonlinearity (idSaturation: LinearInterval), LinearModel (B, F, nk; or B, F, nk at the top, as
idnlhw has them), OutputNonlinearity (idDeadZone: ZeroInterval), Ts, and where they are known NoiseVariance,
Name, InputUnit, OutputUnit. B and F are row vectors in powers of 1/z, in a cell or not. B begins with its nk
zeros, as idnlhw keeps it; where it does not, the nk samples of delay are added. DominantModes (frequency in
Hz, damping ratio; one row a mode) is our own addition. Source: MathWorks, System Identification Toolbox,
"idnlhw", "idSaturation", "idDeadZone".
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy import io

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.files import temporary_sibling
from bayes_hw.formats.matlab_structures import Structure, Value, read_structures

MOST_DELAY = 10_000
MOST_COEFFICIENTS = MOST_DELAY + 1000
MODEL_FIELDS = ("InputNonlinearity", "OutputNonlinearity")
SYMMETRY = 1e-6
"""Largest relative difference of a dead zone's two sides that counts as none."""


def read_idnlhw(path: Path) -> dict[str, Any]:
    """The content of model.json from the one idnlhw structure in a MATLAB file.

    Raises InputError, naming structure and field, on a file without such a structure and on a model that is
    not saturation, discrete transfer function, symmetric dead zone; OSError when it cannot be read.
    """
    found = [s for s in read_structures(path) if all(field in s for field in MODEL_FIELDS)]
    if len(found) != 1:
        raise InputError(
            f"{path}: holds {len(found)} structures with InputNonlinearity and OutputNonlinearity; save one"
        )
    structure = found[0]
    fields = _fields(structure)
    try:
        return _content(fields, structure.name)
    except InputError as error:
        raise InputError(f"{path}: {structure.name}.{error}") from None


def write_idnlhw(
    path: Path, content: Mapping[str, Any], numerator: FloatArray, denominator: FloatArray
) -> None:
    """Write model.json's `content` as a structure `model` that `read_idnlhw` reads.

    `numerator` and `denominator` are those of G in powers of 1/z. Raises InputError where the model has gains
    c1, c2 or c3 other than one, which idSaturation and idDeadZone lack.
    """
    if any(gain != 1 for gain in content.get("normalization", {}).values()):
        raise InputError("normalization: idnlhw has no gains c1, c2, c3; set them to one")
    half_width = content["dead_zone"]["half_width"]
    limits = content["saturation"]
    sigma = content.get("noise", {}).get("sigma")
    structure = {
        "Name": content["name"],
        "Ts": 1 / content["sample_rate_hz"],
        "TimeUnit": "seconds",
        "InputUnit": content["units"]["input"],
        "OutputUnit": content["units"]["output"],
        "InputNonlinearity": {"LinearInterval": [limits["lower"], limits["upper"]]},
        "LinearModel": {
            "B": numerator,
            "F": denominator,
            "nk": int(np.flatnonzero(numerator)[0]),
        },
        "OutputNonlinearity": {"ZeroInterval": [-half_width, half_width]},
        "NoiseVariance": np.zeros((0, 0)) if sigma is None else sigma**2,
        "DominantModes": np.array(
            [[mode["frequency_hz"], mode["damping_ratio"]] for mode in content["dominant_modes"]]
        ).reshape(-1, 2),
    }
    with temporary_sibling(path) as temporary:
        io.savemat(temporary, {"model": structure}, oned_as="row", appendmat=False)


def _fields(structure: Structure) -> dict[str, Value]:
    wanted = (*MODEL_FIELDS, "LinearModel", "B", "F", "nk", "nb", "Ts", "NoiseVariance", "DominantModes")
    texts = ("Name", "TimeUnit", "InputUnit", "OutputUnit")
    return {name: structure.value(name, MOST_COEFFICIENTS) for name in (*wanted, *texts) if name in structure}


def _content(fields: Mapping[str, Value], name: str) -> dict[str, Any]:
    period = _number(fields, "Ts")
    unit = _text(fields, "TimeUnit") or "seconds"
    if unit.lower() not in ("seconds", "second", "s") or not period > 0:
        raise InputError(f"Ts: is {period:g} {unit[:40]}; export a discrete model with its sample time in s")
    lower, upper = _interval(_part(fields, "InputNonlinearity"), "InputNonlinearity.LinearInterval")
    below, above = _interval(_part(fields, "OutputNonlinearity"), "OutputNonlinearity.ZeroInterval")
    if not (above >= 0 and abs(above + below) <= SYMMETRY * max(abs(above), abs(below))):
        raise InputError(
            f"OutputNonlinearity.ZeroInterval: is {below:g} to {above:g}; give one symmetric about zero"
        )
    linear = fields["LinearModel"] if "LinearModel" in fields else dict(fields)
    if not isinstance(linear, dict):
        raise InputError("LinearModel: is not a structure; export its B, F and nk")
    units = {"input": _text(fields, "InputUnit"), "output": _text(fields, "OutputUnit")}
    content: dict[str, Any] = {
        "name": _text(fields, "Name") or name,
        "sample_rate_hz": 1 / period,
        "units": {key: value for key, value in units.items() if value},
        "saturation": {"lower": lower, "upper": upper},
        "linear": _linear(linear),
        "dead_zone": {"half_width": above},
    }
    if "DominantModes" in fields:
        content["dominant_modes"] = _modes(fields["DominantModes"])
    variance = fields.get("NoiseVariance")
    if isinstance(variance, np.ndarray) and variance.size == 1 and float(variance.ravel()[0]) >= 0:
        content["noise"] = {"sigma": float(np.sqrt(variance.ravel()[0]))}
    return content


def _modes(value: Value) -> list[dict[str, float]]:
    if isinstance(value, np.ndarray) and value.size == 0:
        return []
    if not isinstance(value, np.ndarray) or value.ndim != 2 or value.shape[1] != 2:
        raise InputError("DominantModes: is not a matrix of two columns, frequency in Hz and damping ratio")
    return [{"frequency_hz": float(f), "damping_ratio": float(zeta)} for f, zeta in value]


def _linear(fields: Mapping[str, Value]) -> dict[str, list[float]]:
    """Numerator and denominator in powers of 1/z, the delay among the numerator's zeros."""
    numerator, denominator = (_coefficients(fields, label) for label in ("B", "F"))
    delay = _whole(fields, "nk")
    if delay and not _holds_delay(fields, numerator, delay):
        numerator = np.concatenate([np.zeros(delay), numerator])
    return {"numerator": numerator.tolist(), "denominator": denominator.tolist()}


def _holds_delay(fields: Mapping[str, Value], numerator: FloatArray, delay: int) -> bool:
    """Whether B begins with its nk zeros already: by its length nb + nk where nb is told."""
    terms = _whole(fields, "nb")
    if terms:
        return len(numerator) >= terms + delay
    return bool(not numerator[:delay].any())


def _part(fields: Mapping[str, Value], label: str) -> Mapping[str, Value]:
    value = fields[label]
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if not isinstance(value, dict):
        raise InputError(f"{label}: is not a structure; export the object's properties with get")
    return value


def _interval(fields: Mapping[str, Value], label: str) -> tuple[float, float]:
    value = fields.get(label.rpartition(".")[2])
    if not isinstance(value, np.ndarray) or value.size != 2 or not np.isfinite(value).all():
        raise InputError(f"{label}: is not two finite numbers; give both limits")
    low, high = value.ravel().tolist()
    return float(low), float(high)


def _coefficients(fields: Mapping[str, Value], label: str) -> FloatArray:
    value = fields.get(label)
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if not isinstance(value, np.ndarray) or value.size == 0 or max(value.shape) != value.size:
        raise InputError(
            f"{label}: is not one row of coefficients; export a model of one input and one output"
        )
    return value.ravel()


def _whole(fields: Mapping[str, Value], label: str) -> int:
    """A count, 0 where the field is absent."""
    value = fields.get(label, np.zeros(1))
    if (
        not isinstance(value, np.ndarray)
        or value.size != 1
        or float(value.ravel()[0]) not in range(MOST_DELAY)
    ):
        raise InputError(f"{label}: is not one whole number of samples below {MOST_DELAY}")
    return int(value.ravel()[0])


def _number(fields: Mapping[str, Value], label: str) -> float:
    value = fields.get(label)
    if not isinstance(value, np.ndarray) or value.size != 1 or not np.isfinite(value).all():
        raise InputError(f"{label}: is not one finite number")
    return float(value.ravel()[0])


def _text(fields: Mapping[str, Value], label: str) -> str:
    """Text, also of a cell array of one; "" where there is none."""
    value = fields.get(label, "")
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    return value if isinstance(value, str) else ""
