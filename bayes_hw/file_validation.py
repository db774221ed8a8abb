"""Whether a file is what its JSON Schema says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from bayes_hw.errors import InputError
from bayes_hw.file_schemas import MAKERS, schema_of
from bayes_hw.files import read_small_text

LONGEST_MESSAGE = 200
"""Characters of what is wrong: a message may quote the whole file."""


def check_file(path: Path, kind: str | None = None) -> str:
    """The kind of a valid file, as given or as its name or `schema` key says.

    Raises InputError that names the file, the place in it and what is wrong there.
    """
    try:
        content: Any = json.loads(read_small_text(path))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a JSON file") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON ({error})") from None
    found = kind or kind_of(path, content)
    wrong = best_match(Draft202012Validator(schema_of(found)).iter_errors(content))
    if wrong is not None:
        place = wrong.json_path.removeprefix("$").removeprefix(".") or "the top level"
        raise InputError(f"{path}: {place}: {shortened(wrong.message)}; see the format of a {found}")
    return found


def kind_of(path: Path, content: Any) -> str:
    """What a file is, by its `schema` key or its name; raises InputError where neither says."""
    said = content.get("schema") if isinstance(content, dict) else None
    for kind in MAKERS:
        if (isinstance(said, str) and said.startswith(f"bayes-hw/{kind}/")) or path.stem == kind:
            return kind
    if isinstance(content, dict) and {"linear", "saturation", "effects"} <= set(content):
        return "model"
    raise InputError(f"{path}: neither name nor content say what it is; give --kind {' or '.join(MAKERS)}")


def shortened(message: str) -> str:
    """Both ends of a long message."""
    half = LONGEST_MESSAGE // 2
    return message if len(message) <= LONGEST_MESSAGE else f"{message[:half]} ... {message[-half:]}"
