"""A page of the JSON Schemas, and the schemas as files to download: docs/generated/schemas."""

from __future__ import annotations

import json
from pathlib import Path

from effect_gallery import write_if_changed
from sphinx.application import Sphinx

from bayes_hw.file_schemas import MAKERS, schema_of

FOLDER = Path(__file__).resolve().parents[1] / "generated" / "schemas"


def generate(app: Sphinx) -> None:
    """Write one file a schema and the page that shows them."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    parts = [
        "# JSON Schemas",
        "Draft 2020-12, made from `bayes_hw.file_schemas`. A file may hold more keys than its schema names; "
        "none of those required may be missing. `bayes-hw validate FILE...` holds files against them.",
    ]
    for kind in MAKERS:
        schema = schema_of(kind)
        write_if_changed(FOLDER / f"{kind}.schema.json", json.dumps(schema, indent=2) + "\n")
        parts += [
            f"## {kind}",
            f"{schema['description']} {{download}}`{kind}.schema.json <{kind}.schema.json>`",
            f"```{{literalinclude}} {kind}.schema.json\n:language: json\n```",
        ]
    write_if_changed(FOLDER / "index.md", "\n\n".join(parts) + "\n")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the page before Sphinx looks for its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
