"""What .ci/ablation switches off is there under the names that it has for it."""

import importlib.util
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType

import pytest

ABLATION = Path(__file__).parents[1] / ".ci" / "ablation"


@pytest.fixture(scope="module")
def ablation() -> ModuleType:
    loader = SourceFileLoader("ablation", str(ABLATION))
    spec = importlib.util.spec_from_loader("ablation", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["ablation"] = module
    loader.exec_module(module)
    return module


def test_every_strategy_names_what_a_module_has(ablation: ModuleType) -> None:
    missing = [label for label, one in ablation.STRATEGIES.items() if not hasattr(one.module, one.name)]
    assert not missing


def test_a_replacement_is_of_the_kind_of_what_it_replaces(ablation: ModuleType) -> None:
    """A number for a number, else what makes a function of the one it stands for."""
    for label, one in ablation.STRATEGIES.items():
        original = getattr(one.module, one.name)
        if callable(original):
            assert callable(one.without(original)), label
        else:
            assert isinstance(one.without, type(original)), label
