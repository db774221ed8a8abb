"""The content of a model's JSON file, without what it takes to build the model."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bayes_hw.errors import InputError
from bayes_hw.files import read_small_text


def load_model_json(path: Path) -> Any:
    """What the file holds; raises InputError where it cannot be read or is not JSON."""
    try:
        return json.loads(read_small_text(path))
    except InputError:
        raise
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); give a model.json, as from bayes-hw identify"
        ) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON ({error}); give a model.json") from None
