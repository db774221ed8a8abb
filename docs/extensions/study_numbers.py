"""Roles that take numbers from reports/STUDY/results.json, so that no page repeats one by hand.

`{rate}` takes hits and trials: {rate}`08_blind_check:easy/headline/no false alarm` is "52 of 52, 100 %
[93, 100]"; paths joined by `+` are added up. `{number}` takes one value with an optional format:
{number}`09_power:by_setting/120 s, campaign/gap;.2f`; a last part `[0]` picks from a list.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from docutils import nodes
from scipy.stats import binomtest
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import SphinxRole

REPORTS = Path(__file__).resolve().parents[2] / "reports"


class MissingNumberError(SphinxError):
    """A page asks for a number that no study has written."""


@cache
def results(study: str) -> Any:
    """The content of a study's results.json."""
    path = REPORTS / study / "results.json"
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise MissingNumberError(f"{path}: {error.strerror}") from None


def looked_up(study: str, path: str) -> Any:
    """The value at a path of keys, `[i]` for a place in a list; raises MissingNumberError."""
    value = results(study)
    for key in path.split("/"):
        try:
            value = value[int(key[1:-1])] if key.startswith("[") else value[key]
        except (KeyError, IndexError, TypeError):
            raise MissingNumberError(f"reports/{study}/results.json has no {path!r}: {key!r}") from None
    return value


def counted(study: str, paths: str) -> tuple[int, int]:
    """Hits and trials at a path, or the sums of those at paths joined by `+`."""
    found = [looked_up(study, path.strip()) for path in paths.split("+")]
    return sum(one["hits"] for one in found), sum(one["trials"] for one in found)


def percent(hits: int, trials: int) -> str:
    """A share in percent with its exact 95 % interval."""
    if not trials:
        return "none tried"
    low, high = binomtest(hits, trials).proportion_ci(0.95)
    places = 1 if 0.995 <= hits / trials < 1 or 0 < hits / trials < 0.005 else 0
    return f"{hits} of {trials}, {100 * hits / trials:.{places}f} % [{100 * low:.0f}, {100 * high:.0f}]"


class RateRole(SphinxRole):
    """Hits of trials with a binomial interval."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        study, _, path = self.text.partition(":")
        return [nodes.Text(percent(*counted(study, path)))], []


class NumberRole(SphinxRole):
    """One number."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        study, _, rest = self.text.partition(":")
        path, _, style = rest.partition(";")
        value = looked_up(study, path)
        return [nodes.Text("beyond those tried" if value is None else format(value, style))], []


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the roles."""
    app.add_role("rate", RateRole())
    app.add_role("number", NumberRole())
    return {"parallel_read_safe": True, "parallel_write_safe": True}
