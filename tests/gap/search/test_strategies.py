"""Every strategy of the search names a test that exists, in which its case is found."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from bayes_hw.gap.search.strategies import STRATEGIES, Strategy

TESTS = Path(__file__).parents[1]


@pytest.mark.parametrize("strategy", STRATEGIES, ids=lambda s: s.seek.__name__)
def test_a_case_shows_why_it_exists(strategy: Strategy) -> None:
    module, function = strategy.shown_by.split("::")
    tree = ast.parse((TESTS / module).read_text(encoding="utf-8"))
    assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert strategy.seek.__doc__
