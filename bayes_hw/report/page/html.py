"""The report as one self-contained HTML page."""

from __future__ import annotations

import base64
import hashlib
import json
from importlib.resources import files
from typing import Any
from urllib.parse import quote

from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup, escape

from bayes_hw.report.page.content import report_content
from bayes_hw.report.page.document import TEXT_WIDTH_INCHES, Report
from bayes_hw.report.page.palette import page_colours
from bayes_hw.report.page.pdf import formula_svg

TEMPLATES = files("bayes_hw.report.page") / "templates"


def to_html(report: Report) -> str:
    """The page: no script, style, font or picture from outside, and a policy that forbids any."""
    content = report_content(report)
    script = _asset("zoom.js") if _has_zoom(content) else ""
    environment = Environment(
        loader=DictLoader({"report.html": _asset("report.html")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data_uri"] = _svg_data_uri
    environment.filters["script_json"] = script_json
    environment.filters["formula_svg"] = formula_svg
    environment.filters["breakable"] = breakable
    environment.filters["percent_of_column"] = _percent_of_column
    return environment.get_template("report.html").render(
        report=content,
        style=Markup(_asset("report.css")),
        colours=page_colours(),
        script=Markup(script),
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii"),
    )


def _asset(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def _has_zoom(content: dict[str, Any]) -> bool:
    return any(
        block["kind"] == "zoomable_record" for section in content["sections"] for block in section["blocks"]
    )


def _svg_data_uri(svg: str) -> Markup:
    """Percent-encoded, a quarter shorter than base64 for text, for an attribute in double quotes: single ones
    need no escape, and all that would is encoded."""
    quoted = svg if "'" in svg else svg.replace('"', "'")
    return Markup("data:image/svg+xml;charset=utf-8," + quote(quoted, safe=" ,;:/=()!*+@$?'"))


def script_json(value: Any) -> Markup:
    """JSON that cannot end the script element it stands in."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def breakable(text: str) -> Markup:
    """`text`, escaped, that may go on a new line after an underscore."""
    return escape(text).replace("_", Markup("_<wbr>"))


def _percent_of_column(width_inches: float) -> str:
    return f"{min(100.0, 100 * width_inches / TEXT_WIDTH_INCHES):.1f}%"
