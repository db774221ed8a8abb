"""The head that every page begins with, and what renders a page: imports nothing that draws."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any

from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup

from bayes_hw.report.page.palette import page_colours

TEMPLATES = files("bayes_hw.report.page") / "templates"

Filters = Mapping[str, Callable[..., Any]]


def page_of(
    templates: Mapping[str, str],
    *,
    title: str,
    style: str,
    script: str,
    filters: Filters | None = None,
    **content: Any,
) -> str:
    """A page by the first of `templates`, which begins with head.html and may include the others."""
    return (
        environment(templates, filters)
        .get_template(next(iter(templates)))
        .render(
            title=title,
            style=Markup(style),
            colours=page_colours(),
            script=Markup(script),
            script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii"),
            **content,
        )
    )


def environment(templates: Mapping[str, str], filters: Filters | None = None) -> Environment:
    """What renders `templates` and the head of every page; what is put into them is escaped."""
    found = Environment(
        loader=DictLoader({**templates, "head.html": asset("head.html")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters["script_json"] = script_json
    found.filters |= dict(filters or {})
    return found


def asset(name: str) -> str:
    """The text of a file of the pages' folder."""
    return (TEMPLATES / name).read_text(encoding="utf-8")


def script_json(value: Any) -> Markup:
    """JSON that cannot end the script element it stands in."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
