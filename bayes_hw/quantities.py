"""Units of commands and outputs, converted by pint, which is loaded where two units differ."""

from __future__ import annotations

import functools
import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from bayes_hw.errors import InputError

if TYPE_CHECKING:
    import pint

SPELLINGS = {
    "s": ("sec", "second", "seconds"),
    "deg": ("degree", "degrees", "degs", "°", "º", "arcdeg"),
    "deg/s": (
        *("deg/sec", "degree/s", "degrees/s", "degrees/second", "°/s", "º/s", "dps", "degps", "degs/s"),
        *("degs/sec", "degree/sec", "degrees/sec", "degree/second", "deg/second"),
        *("deg s-1", "deg s^-1", "deg·s^-1", "deg.s-1", "deg*s^-1", "deg per s", "deg s**-1"),
    ),
    "rad": ("radian", "radians"),
    "rad/s": ("rad/sec", "radian/s", "radians/s", "radians/second", "rad s-1", "rad s^-1"),
    "arcsec": ("arcsecond", "arcseconds", "as", '"', "″", "asec"),
    "arcsec/s": ("arcsec/sec", "arcsecond/s", "arcseconds/s", '"/s', "″/s", "as/s", "arcsec s-1"),
    "arcmin": ("arcminute", "arcminutes", "'", "′", "amin"),
}
"""Of units, that mean the same."""

COUNTS = frozenset((
    "count", "counts", "cts", "ct", "tick", "ticks", "lsb", "inc", "increment", "increments", "pulse",
    "pulses",
))  # fmt: skip
WORDS = {
    "°": "deg", "º": "deg", "″": "arcsec", "′": "arcmin", "rev": "turn", "revs": "turn",
    "revolution": "turn", "revolutions": "turn", "cycle": "turn", "sec": "s", "secs": "s",
    "as": "arcsec", "mas": "milliarcsecond", "dps": "deg/s", "rps": "turn/s", "degps": "deg/s",
    "degs": "deg", "nm": "N*m", "knm": "kN*m", "mnm": "mN*m", "n.m": "N*m", "n-m": "N*m",
    "amp": "ampere", "amps": "ampere", "volts": "volt", "gon": "grade", "usec": "us", "msec": "ms",
    "hr": "hour", "hrs": "hour", "h": "hour", "asec": "arcsec", "amin": "arcmin", "mins": "min",
}  # fmt: skip
"""Words of units as logs write them, for pint."""

KNOWN_WORDS = (
    COUNTS | WORDS.keys() | SPELLINGS.keys() | {word for same in SPELLINGS.values() for word in same}
)
"""Words and texts that are a unit, in small letters."""

_STEP = re.compile(
    r"\s*([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)(?:\s*/\s*([0-9]+\.?[0-9]*))?\s*\*?\s*([^0-9\s].*)"
)
_HOURS = re.compile(r"^\(?(?:h|hrs?|hours?)\)?(?=/|$)", re.IGNORECASE)
_SAFE = re.compile(r"[A-Za-zµμ°º″′%\"' ./*^()·²³⁻¹-]*[0-9]?[A-Za-zµμ°º″′ ./*^()·⁻¹-]*[0-9]?[A-Za-z)]*")


def spelt(unit: str) -> str:
    """The unit in the first of its spellings."""
    return next(
        (first for first, others in SPELLINGS.items() if unit.strip().lower() in others), unit.strip()
    )


def with_step(unit: str) -> tuple[float, str]:
    """Factor and unit of a text such as `0.01 deg` or `360/4096 deg`, the step of a count; (1, unit) of any
    other."""
    match = _STEP.fullmatch(unit)
    if match is None or (match[2] is not None and not float(match[2]) > 0):
        return 1.0, unit.strip()
    return float(match[1]) / float(match[2] or 1), match[3].strip()


def conversion(stated: str, wanted: str) -> float:
    """What a number in the unit `stated` is multiplied by to be in `wanted`.

    Both may begin with a step, such as `0.01 deg`. Raises InputError where one is no unit that is known,
    or both
    measure different things.
    """
    step, unit = with_step(stated)
    step_wanted, unit_wanted = with_step(wanted)
    if unit.lower() in COUNTS and step_wanted != 1.0:
        return step * step_wanted
    if spelt(unit) == spelt(unit_wanted):
        return step / step_wanted
    if (unit.lower() in COUNTS) != (unit_wanted.lower() in COUNTS):
        raise InputError(
            f"{stated!r} to {wanted!r}: what one count is worth is not stated; give its step as the unit, "
            "such as "
            "'0.0001 deg' or '360/4096 deg'"
        )
    try:
        factor = _factor(unit, unit_wanted)
    except InputError:
        raise
    except Exception:
        # pint raises its own errors, and those of arithmetic on units with an offset.
        raise InputError(
            f"{stated!r} cannot be converted to {wanted!r}: they measure different things"
        ) from None
    return factor * step / step_wanted


def _factor(unit: str, wanted: str) -> float:
    """One `unit` in `wanted`; beside an angle an hour is one of the hour angle. Raises what pint does."""
    parsed, target = _parsed(unit), _parsed(wanted)
    if not parsed.is_compatible_with(target):
        parsed, target = (_parsed(_HOURS.sub("hourangle", each)) for each in (unit, wanted))
    return float((1.0 * parsed).to(target).magnitude)


SPEEDS = ("/s", "rpm", "/min", "/h")
"""How units of a speed end."""


def is_speed(unit: str) -> bool:
    """Whether an output in it is a speed, which has no origin to count from."""
    return unit.endswith(SPEEDS)


METRES = ("m", "mm", "cm", "km", "um", "µm", "μm", "nm")


def output_word(unit: str) -> str:
    """What an output in a unit is called: a position where it is a length, a speed, or an angle."""
    if is_speed(unit):
        return "speed"
    return "position" if with_step(unit)[1] in METRES else "angle"


def speed_of(output: str, command: str) -> float | None:
    """The output's speed per s, in its unit, of a command of one that the axis follows exactly; None
    where the
    units do not tell, as of a command in V."""
    if spelt(command) == f"{spelt(output)}/s":
        return 1.0
    if output.lower() in COUNTS:
        return None
    try:
        return conversion(command, f"({output})/s")
    except InputError:
        return None


def mixed(output: str, command: str) -> str | None:
    """What an output in one unit beside a command in a multiple of another may be told as; None where they
    agree, or where one of them is no angle."""
    factor = speed_of(output, command)
    turned = command.removesuffix("/s")
    if factor in (None, 1.0) or turned == command or "at the" in command:
        return None
    return (
        f"the command is in {command} and the output in {output}, and both are taken so; "
        f"--output-unit {shlex.quote(turned)} converts the output to {turned}"
    )


@contextmanager
def _without(*modules: str) -> Iterator[None]:
    """Those of some modules that are not loaded are not found by an import that takes all it finds: pint has
    dask, babel and SciPy loaded where they are installed, in half a second, for uses that are none here."""
    held: dict[str, Any] = sys.modules
    absent = [module for module in modules if module not in held]
    held.update(dict.fromkeys(absent))
    try:
        yield
    finally:
        for module in absent:
            del held[module]


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    with _without("dask", "babel", "scipy"):
        import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(cache_folder=None)
    registry.define("hourangle = 15 * degree = hms")
    return registry


def _parsed(unit: str) -> Any:
    """The unit as pint has it; only short texts of letters and signs reach its parser."""
    text = unit.strip()
    if not text or len(text) > 40 or not _SAFE.fullmatch(text):
        raise InputError(
            f"{unit[:40]!r} is no unit that is known; give one such as deg, arcsec, rad/s, rpm or V"
        )
    text = (
        text.replace("·", "*")
        .replace("²", "^2")
        .replace("³", "^3")
        .replace("⁻¹", "^-1")
        .replace("^-1", "**-1")
    )
    text = re.sub(r"(?<=[A-Za-z])-1\b", "**-1", text)
    words = re.sub(r"[A-Za-zµμ°º″′]+(?:[.-]m\b)?", lambda match: WORDS.get(match[0].lower(), match[0]), text)
    words = words.replace('"', "arcsec").replace("'", "arcmin").replace("**-1", "**(-1)")
    try:
        found = _registry().parse_units(words)
    except Exception:
        # pint raises errors of its own, of its tokenizer and of arithmetic.
        raise InputError(
            f"{unit!r} is no unit that is known; give one such as deg, arcsec, rad/s or V"
        ) from None
    return found
