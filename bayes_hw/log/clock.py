"""Time stamps in the ways in which logs write them, as seconds.

Numbers: s, or another unit that is stated; Unix stamps in s, ms, us or ns; Windows file times (100 ns since
1601); modified Julian dates, Julian dates and MATLAB's datenum, in days. Text: ISO 8601 with or without a
zone,
MATLAB's datetime, day/month/year and month/day/year, times of day, durations.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.formats.table import Column
from bayes_hw.formats.text_layout import MISSING, NUMBER, number_of

if TYPE_CHECKING:
    import pandas as pd

DAY_S = 86_400.0
HALF_AN_HOUR_NS = 1_800_000_000_000
UNZONED = " without a zone, taken as UTC"
UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0,
    "ms": 1e-3, "msec": 1e-3, "millisecond": 1e-3, "milliseconds": 1e-3,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "usec": 1e-6, "microsecond": 1e-6, "microseconds": 1e-6,
    "ns": 1e-9, "nsec": 1e-9, "nanosecond": 1e-9, "nanoseconds": 1e-9,
    "min": 60.0, "mins": 60.0, "minute": 60.0, "minutes": 60.0,
    "h": 3600.0, "hr": 3600.0, "hrs": 3600.0, "hour": 3600.0, "hours": 3600.0,
    "d": DAY_S, "day": DAY_S, "days": DAY_S, "mjd": DAY_S, "jd": DAY_S,
}  # fmt: skip
"""Seconds in each unit of time."""

PER_SECOND = {1e-3: 1_000, 1e-6: 1_000_000, 1e-9: 1_000_000_000, 1e-7: 10_000_000}

UNIX = ((1e8, 1e10, 1.0, "s"), (1e11, 1e13, 1e-3, "ms"), (1e14, 1e16, 1e-6, "us"), (1e17, 1e19, 1e-9, "ns"))
"""Sizes of Unix stamps of 1973 to 2286 in each unit."""

FILE_TIME = (1.2e17, 1.6e17)
FILE_TIME_EPOCH_S = 11_644_473_600
MJD, MJD_EPOCH = (3e4, 1e5), 40_587.0
JULIAN, JULIAN_EPOCH = (2.4e6, 2.6e6), 2_440_587.5
DATENUM, DATENUM_EPOCH = (7.1e5, 7.6e5), 719_529.0
SMALLEST_DAY_STEP = 1.2e-4
"""A step of 10 s in days: clocks in days are known by theirs being smaller."""

_PLAIN = re.compile(r"(?:19|20)\d\d-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:\.\d{1,9})?Z?")
_ZONE = re.compile(r"\s*(?:UTC|GMT|utc|gmt)$")
_AFTER_OFFSET = re.compile(r"(?<=\d)(Z|[+-]\d\d:?(?:\d\d)?)\s*\[[^\]]*\]$")
"""A zone named behind the offset that it has."""

_PLACE = re.compile(r"(?<=\d)\s*\[?([A-Z][A-Za-z_]+(?:/[A-Za-z_+-]+[0-9]*)+)\]?$")
"""A zone by the name of a place, such as Europe/Berlin."""

_ZONE_NAME = re.compile(r"(?<=\d) ?([A-Z]{3,5})$")
"""Abbreviations of zones say no offset for certain: CST is one of three."""

_BARE = re.compile(
    r"(?P<whole>.*?\d)(?:[.,](?P<fraction>\d+))?(?P<zone>\s*(?:Z|z|[+-]\d\d:?\d\d|AM|PM|am|pm))?$"
)
_DURATION = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([a-zA-Zµμ]+)")
_TIME_OF_DAY = re.compile(r"(?:(\d+)[. d]\s*)?(\d+):(\d\d)(?::(\d\d(?:[.,]\d+)?))?")
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DAY, _MONTH, _YEAR = r"(?P<d>\d{1,2})", rf"(?P<m>(?i:{'|'.join(MONTHS)}))[a-z]*\.?", r"(?P<y>\d{4})"
_CLOCK = r"(?P<t>\d{1,2}:\d\d:\d\d(?:[.,:]\d+)?)"
_WITH_MONTH = [
    re.compile(rf"(?:[A-Z][a-z]{{2,8}},?\s+)?{date}\s*$")
    for date in (
        rf"{_DAY}[\s/-]?{_MONTH}[\s/,-]*{_YEAR}[\sT:_,]+{_CLOCK}(?P<z>.*)",
        rf"{_MONTH}\s+{_DAY},?\s+{_YEAR},?\s+{_CLOCK}(?P<z>.*)",
        rf"{_MONTH}\s+{_DAY}\s+{_CLOCK}(?P<z>.*?)\s+{_YEAR}",
        rf"{_YEAR}[\s/-]?{_MONTH}[\s/-]?{_DAY}[\sT:_,]+{_CLOCK}(?P<z>.*)",
    )
]
"""Dates whose month is a name, in every order: it says which number is which."""

FORMATS = (
    "%Y/%m/%d %H:%M:%S", "%d.%m.%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%d-%m-%Y %H:%M:%S",
    "%Y.%m.%d %H:%M:%S", "%m/%d/%Y %I:%M:%S %p", "%Y-%j %H:%M:%S", "%Y:%j:%H:%M:%S", "%Y%m%d %H%M%S",
    "%Y%m%d_%H%M%S", "%d-%b-%y %H:%M:%S", "%m/%d/%y %H:%M:%S", "%d.%m.%y %H:%M:%S", "%Y-%m-%d %H:%M:%S",
    "%Y-%m-%d %I:%M:%S %p",
)  # fmt: skip
"""Of dates that are not ISO 8601, without fractions of a second; day before month where both fit a slash only
if the first number says so."""


class Stamps(NamedTuple):
    """Seconds (samples,), NaN where there is no stamp, and what was taken for what.

    `origin_ns` is the Unix time in ns at which seconds are zero, None where the clock counts from nowhere
    known. `unit` is what plain numbers were taken to count, empty of stamps that say it themselves.
    """

    seconds: FloatArray
    origin_ns: int | None
    said: str
    unit: str = ""


class StampError(InputError):
    """A stamp that cannot be read: `index` is its sample."""

    def __init__(self, index: int, message: str) -> None:
        super().__init__(message)
        self.index = index


def read_stamps(values: Column, name: str = "t", unit: str | None = None) -> Stamps:
    """Seconds from a column of stamps, numbers or text; `unit` is that stated for it or None.

    Absolute stamps count from the first. Raises InputError on a unit of no time, StampError on a stamp that
    cannot be read.
    """
    return _from_text(values) if values.dtype.kind in "UO" else _from_numbers(values, name, unit)


def _from_numbers(values: Column, name: str, unit: str | None) -> Stamps:
    finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    if len(values) == 0:
        return Stamps(np.zeros(0), None, "")
    if len(finite) == 0:
        raise StampError(0, "there is no time stamp")
    stated = (unit or "").strip().lower()
    size = abs(float(np.quantile(finite, 0.5, method="lower")))
    gaps = np.abs(np.diff(finite[:10_000]))
    step = float(np.quantile(gaps, 0.5, method="lower")) if len(gaps) else 0.0
    label = name.casefold()
    if stated in (
        "",
        "-",
        "unix",
        "epoch",
        "date",
        "datetime",
        "timestamp",
        "utc",
        "tai",
        "mjd",
        "jd",
        "d",
        "day",
        "days",
    ):
        days = _days(values, size, step, f"{label} {stated}")
        if days is not None:
            return days
    if stated in ("", "-", "unix", "epoch", "timestamp", "utc", "tai", "date", "datetime"):
        if FILE_TIME[0] <= size <= FILE_TIME[1]:
            return _absolute(values, 1e-7, -FILE_TIME_EPOCH_S, "Windows file times (100 ns)")
        for lower, upper, scale, word in UNIX:
            if lower <= size <= upper:
                return _absolute(values, scale, 0, f"Unix stamps in {word}")
        return Stamps(np.asarray(values, dtype=np.float64), None, "", "s")
    if stated not in UNITS:
        raise InputError(f"states its times in {unit!r}; give --time-unit s, ms, us, ns, min, h or d")
    scale = UNITS[stated]
    if 1e8 <= size * scale <= 1e10:
        return _absolute(values, scale, 0, f"Unix stamps in {stated}")
    seconds = _scaled(values, scale)
    return Stamps(seconds, None, "" if scale == 1 else f"times converted from {unit} to s", stated)


def _days(values: Column, size: float, step: float, label: str) -> Stamps | None:
    """Stamps in days, where size and step, or the name, say so."""
    small = 0 < step < SMALLEST_DAY_STEP
    for word, (lower, upper), epoch, said in (
        ("mjd", MJD, MJD_EPOCH, "modified Julian dates"),
        ("jd", JULIAN, JULIAN_EPOCH, "Julian dates"),
        ("datenum", DATENUM, DATENUM_EPOCH, "MATLAB serial dates"),
    ):
        if lower <= size <= upper and small:
            scale = " (TAI)" if "tai" in label else " (UTC)" if "utc" in label else ""
            first = float(values[np.isfinite(values)][0])
            origin = round((first - epoch) * DAY_S * 1e9)
            text = f"{said}{scale}, counted from the first, {first:.6f}"
            return Stamps((np.asarray(values, dtype=np.float64) - first) * DAY_S, origin, text)
        if word in label.split() and word != "jd":
            return Stamps(_scaled(values, DAY_S), None, f"{said}, days converted to s")
    return None


def _scaled(values: Column, scale: float) -> FloatArray:
    per_second = PER_SECOND.get(scale)
    return np.asarray(values / per_second if per_second else values * scale, dtype=np.float64)


def _absolute(values: Column, scale: float, epoch_s: int, word: str) -> Stamps:
    first = values[np.isfinite(values)][0]
    if values.dtype.kind == "i":
        origin = int(first) * round(scale * 1e9) if scale >= 1e-9 else int(first)
    else:
        origin = round(float(first) * scale * 1e9)
    origin += epoch_s * 1_000_000_000
    said = f"{word}, counted from the first, {_iso(origin)}"
    return Stamps(_scaled(values - first, scale), origin, said)


def _iso(origin_ns: int) -> str:
    """To the nearest microsecond: a stamp in s as a double is no better."""
    return f"{np.datetime64((origin_ns + 500) // 1000, 'us')}Z"


def _from_text(values: Column) -> Stamps:
    cells = np.char.strip(values.astype(np.str_))
    missing = np.isin(np.char.lower(cells), sorted(MISSING))
    present = np.flatnonzero(~missing)
    if len(cells) == 0:
        return Stamps(np.zeros(0), None, "")
    if len(present) == 0:
        raise StampError(0, "there is no time stamp")
    first = str(cells[present[0]])
    if NUMBER.fullmatch(first):
        at = next(int(i) for i in present if not _is_finite_number(str(cells[i])))
        raise StampError(
            at,
            f"time stamp {str(cells[at])[:40]!r} is no number as the others are; correct it or remove "
            "the row",
        )
    if _DURATION.fullmatch(first):
        seconds, said = _durations(cells, present), "durations with their units"
        return Stamps(seconds, None, f"{said}, in s")
    if _TIME_OF_DAY.fullmatch(first):
        return _times_of_day(cells, present)
    nanoseconds, said = _dates(cells, present)
    origin = int(nanoseconds[0])
    seconds = np.full(len(cells), np.nan)
    seconds[present] = (nanoseconds - origin) / 1e9
    return Stamps(seconds, origin, f"{said}, counted from the first, {first}")


def _is_finite_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell) is not None and math.isfinite(number_of(cell))


def _durations(cells: Column, present: IntArray) -> FloatArray:
    seconds = np.full(len(cells), np.nan)
    for i in present:
        match = _DURATION.fullmatch(str(cells[i]))
        if match is None or match[2].lower() not in UNITS:
            raise StampError(int(i), f"time stamp {str(cells[i])[:40]!r} is no duration; correct it")
        try:
            seconds[i] = float(match[1]) * UNITS[match[2].lower()]
        except ValueError:
            raise StampError(
                int(i), f"time stamp {str(cells[i])[:40]!r} is no duration; correct it"
            ) from None
    return seconds


def _times_of_day(cells: Column, present: IntArray) -> Stamps:
    """hh:mm:ss, mm:ss.f, or days before them; midnight passed where the clock goes back by most of a day."""
    seconds = np.full(len(cells), np.nan)
    for i in present:
        match = _TIME_OF_DAY.fullmatch(str(cells[i]))
        if match is None:
            raise StampError(int(i), f"time stamp {str(cells[i])[:40]!r} is no time of day; correct it")
        days, a, b, c = match.groups()
        if c is None:
            seconds[i] = 60 * int(a) + int(b)
        else:
            seconds[i] = DAY_S * int(days or 0) + 3600 * int(a) + 60 * int(b) + float(c.replace(",", "."))
    shown = seconds[present]
    passed = np.concatenate([[0], np.cumsum(np.diff(shown) < -DAY_S / 2)])
    seconds[present] = shown + DAY_S * passed
    over = ", past midnight" if passed[-1] else ""
    return Stamps(seconds - seconds[present[0]], None, f"times of day from {cells[present[0]]}{over}, in s")


def _dates(cells: Column, present: IntArray) -> tuple[IntArray, str]:
    """Unix time in ns of the cells that are present, and what they were taken for."""
    if (plainest := _plain_dates(cells[present])) is not None:
        return plainest
    import pandas as pd

    given, named = _with_numbered_months(pd.Series(cells[present].tolist(), dtype="object"))
    given = given.str.replace(_AFTER_OFFSET, r"\1", regex=True).str.replace(r"\s*\[UTC\]$", "Z", regex=True)
    given = given.str.replace(_ZONE, "Z", regex=True)
    place = _PLACE.search(given.iloc[0])
    if place is not None:
        return _at_a_place(cells, present, given, place[1])
    given, zone = _without_zone_name(given)
    plain = given.str.replace(r"(?<![\d:])(\d{1,2}:\d{2}:\d{2})[,:](\d+)", r"\1.\2", regex=True)
    plain = plain.str.replace(r"\s+([+-]\d\d:?\d\d)$", r"\1", regex=True)
    plain = plain.str.replace(r"^(\d{4}-\d\d-\d\d)[_ ]+(?=\d)", r"\1T", regex=True)
    iso = pd.to_datetime(plain, format="ISO8601", errors="coerce", utc=True)
    unread = iso.isna().to_numpy()
    if not unread[0]:
        if unread.any():
            at = int(np.flatnonzero(unread)[0])
            raise StampError(
                int(present[at]), f"time stamp {str(cells[present[at]])[:40]!r} is not ISO 8601; correct it"
            )
        zones = (named or "ISO 8601 stamps") + ("" if _has_zone(str(plain.iloc[0])) else UNZONED)
        return _nanoseconds(iso), zones + zone
    nanoseconds, said = _other_dates(cells, present, plain)
    return nanoseconds, said + zone


def _plain_dates(cells: Column) -> tuple[IntArray, str] | None:
    """As `_dates`, of ISO 8601 stamps that are all alike and need no library; None of others."""
    has_zone = str(cells[0]).endswith("Z")
    if not all(_PLAIN.fullmatch(cell) and cell.endswith("Z") == has_zone for cell in cells.tolist()):
        return None
    try:
        dates = np.char.rstrip(cells, "Z").astype("datetime64[ns]")
    except ValueError:
        return None
    return dates.astype(np.int64), "ISO 8601 stamps" + ("" if has_zone else UNZONED)


def _with_numbered_months(given: pd.Series[str]) -> tuple[pd.Series[str], str]:
    """Stamps with the name of a month as ISO 8601 has them, and what to say of them; others as they are."""
    form = next((form for form in _WITH_MONTH if form.match(given.iloc[0])), None)
    if form is None:
        return given, ""

    def numbered(match: re.Match[str]) -> str:
        month = MONTHS.index(match["m"].lower()) + 1
        hour, rest = match["t"].split(":", 1)
        return f"{match['y']}-{month:02d}-{int(match['d']):02d} {hour:0>2}:{rest}{match['z'].rstrip()}"

    return given.str.replace(form, numbered, regex=True), "dates with the name of the month"


def _without_zone_name(given: pd.Series[str]) -> tuple[pd.Series[str], str]:
    """Stamps without the abbreviations of zones behind them, and what to say of it. Where the clock went over
    to or from summer time they change, and the hour by which it jumps is found as without them."""
    names = given.str.extract(_ZONE_NAME)[0].dropna().unique().tolist()
    if not names:
        return given, ""
    return given.str.replace(_ZONE_NAME, "", regex=True), f" ({', '.join(names)} left out)"


def _at_a_place(cells: Column, present: IntArray, given: pd.Series[str], place: str) -> tuple[IntArray, str]:
    """Unix time in ns of local stamps that name a place; raises StampError where no such zone is known, or
    a stamp is none of its times."""
    from zoneinfo import ZoneInfo

    import pandas as pd

    local, said = _dates(np.array(given.str.replace(_PLACE, "", regex=True).tolist()), np.arange(len(given)))
    is_again = np.cumsum(np.diff(local, prepend=local[0]) < -HALF_AN_HOUR_NS) > 0
    try:
        dates = pd.DatetimeIndex(local.astype("datetime64[ns]")).tz_localize(
            ZoneInfo(place), ambiguous=~is_again
        )
    except (ValueError, OSError, KeyError):
        raise StampError(
            int(present[0]),
            f"time stamp {str(cells[present[0]])[:60]!r} names a zone that is not known, or has not this "
            "hour; give stamps in UTC",
        ) from None
    return dates.asi8, f"{said.removesuffix(UNZONED)} at {place}"


def _has_zone(text: str) -> bool:
    return bool(re.search(r"(Z|z|[+-]\d\d:?(\d\d)?)$", text))


def _nanoseconds(dates: pd.Series[pd.Timestamp]) -> IntArray:
    return dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]").astype(np.int64)


def _other_dates(cells: Column, present: IntArray, plain: pd.Series[str]) -> tuple[IntArray, str]:
    import pandas as pd

    parts = plain.str.extract(_BARE)
    whole = parts["whole"].fillna("").str.replace(r"(?<=\d)T(?=\d)", " ", regex=True)
    marks = parts["zone"].fillna("").str.strip()
    half_day = marks.str.upper().isin(["AM", "PM"])
    whole = whole.where(~half_day, whole + " " + marks.str.upper())
    fraction = parts["fraction"].fillna("0").str.slice(0, 9).str.pad(9, "right", "0").astype(np.int64)
    best: tuple[BoolArray, pd.Series[pd.Timestamp], str] | None = None
    for form in FORMATS:
        if pd.isna(pd.to_datetime(whole.iloc[0], format=form, errors="coerce")):
            continue
        dates = pd.to_datetime(whole, format=form, errors="coerce")
        unread = dates.isna().to_numpy()
        if best is None or unread.sum() < best[0].sum():
            best = (unread, dates, form)
        if not unread.any():
            break
    if best is None or best[0].any():
        at = int(np.flatnonzero(best[0])[0]) if best else 0
        raise StampError(
            int(present[at]),
            f"time stamp {str(cells[present[at]])[:40]!r} is no time that is read; give s, Unix time, ISO "
            "8601 "
            "(2026-03-14T22:41:07.05Z), MATLAB's datetime or MJD",
        )
    words = {"%d": "day", "%b": "month", "%m": "month", "%Y": "year", "%y": "year", "%j": "day of year"}
    order = " ".join(words[part] for part in re.findall("%[dbmYyj]", best[2]))
    return _nanoseconds(best[1]) + fraction.to_numpy(), f"dates as {order}"
