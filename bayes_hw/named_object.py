"""What a user names as MODULE:FUNCTION."""

from __future__ import annotations

import importlib
from typing import Any

from bayes_hw.errors import InputError


def named_object(name: str, option: str) -> Any:
    """What stands under this name in a module that Python finds; raises InputError where there is nothing."""
    module, _, function = name.partition(":")
    try:
        return getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError, SyntaxError) as error:
        raise InputError(
            f"{option} {name}: cannot be imported ({error}); give MODULE:FUNCTION of a module that Python "
            "finds (PYTHONPATH)"
        ) from None
