"""What a simulator's file does not say: a small TOML file beside it.

[command]
actuators = ["rate", "hold"]    # that take the command; of an FMU: variables = ["command"]
unit = "deg/s"                  # of the records
simulator_unit = "rad/s"
[measured]
joint = "azimuth"               # or sensor = "encoder"; of an FMU: variable = "angle"
unit = "deg"
simulator_unit = "rad"
[record]
sample_rate_hz = 50.0
[noise]
sigma = 0.002                   # in units of the record; leave out where it is not known
[[uncertain]]
parameter = "joint/motor/armature"    # of an FMU: the variable's name
relative_sd = 0.2
[forces.motor]                  # where friction and ripple may enter: motor, load, or both
joint = "motor"                 # of an FMU: input, position and speed, names of variables
ratio = 1.0                     # turns of this joint a turn of the output
[forces.compliance]             # where a gap or a spring that is not linear may enter
tendon = "gear"                 # or joint = "gear"
[known.wind_torque]             # a further column of the records, read with them
door = "load"                   # where it enters: motor or load, which [forces] names
factor = 1.0                    # the simulator's torque a unit of the column
[loop]                          # where the simulator has no velocity loop of its own
proportional = 120.0
integral = 500.0
speed_of = "motor"              # the joint whose speed it measures
torque_on = "motor"             # the joint that it drives, where no actuator takes the command
limit = 100.0
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from bayes_hw.errors import InputError
from bayes_hw.files import read_small_text
from bayes_hw.quantities import conversion
from bayes_hw.units import Units

FORCE_DOORS = ("motor", "load")
DOORS = (*FORCE_DOORS, "compliance")
SECTIONS = ("name", "command", "measured", "record", "noise", "uncertain", "forces", "known", "loop")


@dataclass(frozen=True)
class Uncertain:
    """A parameter of the simulator and how well it is known: the standard deviation of its logarithm."""

    parameter: str
    relative_sd: float


@dataclass(frozen=True)
class Door:
    """Where a force may enter. `joint` or `tendon` of a MuJoCo model; `input`, `position` and `speed` of an
    FMU. Its positions divided by `ratio` are positions of the output."""

    name: str
    ratio: float = 1.0
    joint: str = ""
    tendon: str = ""
    input: str = ""
    position: str = ""
    speed: str = ""


@dataclass(frozen=True)
class KnownForce:
    """A measured `column` of the records that enters at a door: `factor` is the simulator's force a unit."""

    column: str
    door: str
    factor: float


@dataclass(frozen=True)
class Loop:
    """effort = proportional e + integral of e times integral, within the limit; e = command - speed."""

    proportional: float
    integral: float
    limit: float
    speed_of: str
    torque_on: str


@dataclass(frozen=True)
class Declaration:
    """What a TOML file says of a simulator; `path` is named in messages."""

    path: str
    name: str
    actuators: tuple[str, ...]
    units: Units
    command_unit: str
    measured: Mapping[str, str]
    measured_unit: str
    sample_rate_hz: float
    step_s: float
    noise_sigma: float
    uncertain: tuple[Uncertain, ...]
    doors: tuple[Door, ...]
    known: tuple[KnownForce, ...]
    loop: Loop | None

    @classmethod
    def read(cls, path: Path) -> Declaration:
        """Read a file; raises InputError on what is missing, unknown or no number, and says what to give."""
        try:
            data = tomllib.loads(read_small_text(path))
        except InputError:
            raise
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror}); give --declaration FILE") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise InputError(f"{path}: is not TOML ({error})") from None
        return cls.from_dict(data, str(path))

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], path: str) -> Declaration:
        """The same of what a file holds."""
        _only(data, SECTIONS, path, "")
        command, measured = _table(data, "command", path), _table(data, "measured", path)
        _only(command, ("actuators", "variables", "unit", "simulator_unit"), path, "command.")
        _only(measured, ("joint", "sensor", "variable", "unit", "simulator_unit"), path, "measured.")
        where = {key: _text(measured, key, path, "measured.") for key in measured if "unit" not in key}
        if len(where) != 1:
            raise InputError(f"{path}: measured: give one of joint, sensor and variable")
        record = _table(data, "record", path)
        _only(record, ("sample_rate_hz", "step_s"), path, "record.")
        units = Units(
            input=_text(command, "unit", path, "command.", "deg/s"),
            output=_text(measured, "unit", path, "measured.", "deg"),
        )
        found = cls(
            path,
            _text(data, "name", path, "", Path(path).stem),
            tuple(_texts(command, "actuators", path) or _texts(command, "variables", path)),
            units,
            _text(command, "simulator_unit", path, "command.", units.input),
            where,
            _text(measured, "simulator_unit", path, "measured.", units.output),
            _number(record, "sample_rate_hz", path, "record."),
            _number(record, "step_s", path, "record.") if "step_s" in record else 0.0,
            _number(data["noise"], "sigma", path, "noise.") if "noise" in data else float("nan"),
            tuple(_uncertain(item, path) for item in data.get("uncertain", ())),
            _doors(data.get("forces", {}), path),
            _known(data.get("known", {}), path),
            _loop(data["loop"], path) if "loop" in data else None,
        )
        if not found.uncertain:
            raise InputError(f"{path}: uncertain: give at least one parameter with its relative_sd")
        if not found.actuators and (found.loop is None or not found.loop.torque_on):
            raise InputError(f"{path}: command.actuators: is missing; say what takes the command")
        doors = {door.name for door in found.doors}
        if missing := [known.door for known in found.known if known.door not in doors]:
            raise InputError(f"{path}: known: no [forces.{missing[0]}], where a column is to enter; give it")
        _ = found.input_factor, found.output_factor
        return found

    @cached_property
    def input_factor(self) -> float:
        """The simulator's command over that of the record."""
        return conversion(self.units.input, self.command_unit)

    @cached_property
    def output_factor(self) -> float:
        """The record's output over that of the simulator."""
        return conversion(self.measured_unit, self.units.output)


def _uncertain(item: Any, path: str) -> Uncertain:
    if not isinstance(item, Mapping):
        raise InputError(f"{path}: uncertain: must be [[uncertain]] tables")
    _only(item, ("parameter", "relative_sd"), path, "uncertain.")
    return Uncertain(
        _text(item, "parameter", path, "uncertain."), _number(item, "relative_sd", path, "uncertain.")
    )


def _doors(forces: Any, path: str) -> tuple[Door, ...]:
    if not isinstance(forces, Mapping):
        raise InputError(f"{path}: forces: must be [forces.motor] and the like")
    _only(forces, DOORS, path, "forces.")
    found = []
    for name in DOORS:
        if name not in forces:
            continue
        table, label = _table(forces, name, path), f"forces.{name}."
        places = ("joint", "tendon", "input", "position", "speed")
        _only(table, (*places, "ratio"), path, label)
        ratio = _number(table, "ratio", path, label) if "ratio" in table else 1.0
        given = {key: _text(table, key, path, label) for key in places if key in table}
        if not given:
            raise InputError(f"{path}: {label[:-1]}: give its joint, or of an FMU input, position and speed")
        found.append(Door(name, ratio, **given))
    return tuple(found)


def _known(tables: Any, path: str) -> tuple[KnownForce, ...]:
    if not isinstance(tables, Mapping):
        raise InputError(f"{path}: known: must be [known.COLUMN] and the like")
    found = []
    for column in tables:
        table, label = _table(tables, column, path), f"known.{column}."
        _only(table, ("door", "factor"), path, label)
        door = _text(table, "door", path, label)
        if door not in FORCE_DOORS:
            raise InputError(f"{path}: {label}door: give one of {', '.join(FORCE_DOORS)}")
        factor = table.get("factor", 1.0)
        if isinstance(factor, bool) or not isinstance(factor, int | float):
            raise InputError(f"{path}: {label}factor: must be a number")
        found.append(KnownForce(column, door, float(factor)))
    return tuple(found)


def _loop(table: Any, path: str) -> Loop:
    if not isinstance(table, Mapping):
        raise InputError(f"{path}: loop: must be a [loop] table")
    _only(table, ("proportional", "integral", "limit", "speed_of", "torque_on"), path, "loop.")
    return Loop(
        _number(table, "proportional", path, "loop."),
        _number(table, "integral", path, "loop.", zero=True) if "integral" in table else 0.0,
        _number(table, "limit", path, "loop.") if "limit" in table else float("inf"),
        _text(table, "speed_of", path, "loop."),
        _text(table, "torque_on", path, "loop.", ""),
    )


def _only(table: Mapping[str, Any], known: tuple[str, ...], path: str, label: str) -> None:
    for key in table:
        if key not in known:
            raise InputError(f"{path}: {label}{key}: unknown; use {', '.join(known)}")


def _table(data: Mapping[str, Any], key: str, path: str) -> Mapping[str, Any]:
    found = data.get(key)
    if not isinstance(found, Mapping):
        raise InputError(f"{path}: {key}: is missing; give a [{key}] table")
    return found


def _text(data: Mapping[str, Any], key: str, path: str, label: str, default: str | None = None) -> str:
    found = data.get(key, default)
    if not isinstance(found, str):
        raise InputError(f"{path}: {label}{key}: must be text")
    return found


def _texts(data: Mapping[str, Any], key: str, path: str) -> list[str]:
    found = data.get(key, [])
    if not isinstance(found, list) or not all(isinstance(item, str) for item in found):
        raise InputError(f"{path}: command.{key}: must be a list of names")
    return found


def _number(data: Any, key: str, path: str, label: str, zero: bool = False) -> float:
    found = data.get(key) if isinstance(data, Mapping) else None
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise InputError(f"{path}: {label}{key}: must be a number")
    if not (found > 0 or (zero and found == 0)):
        raise InputError(f"{path}: {label}{key}: {found:g} is not positive")
    return float(found)
