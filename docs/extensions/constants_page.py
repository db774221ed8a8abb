"""Numbers that stand in the modules of the diagnosis, counted by room: docs/generated/constants.txt."""

from __future__ import annotations

import ast
import json
from collections import Counter
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).resolve().parents[1]
GAP = HERE.parent / "bayes_hw" / "gap"
TARGET = HERE / "generated" / "constants.txt"


def is_number(node: ast.expr) -> bool:
    """Whether an expression is a number, or arithmetic of numbers."""
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def is_numeric(node: ast.expr) -> bool:
    """The same, or a tuple of numbers."""
    return is_number(node) or (
        isinstance(node, ast.Tuple) and bool(node.elts) and all(map(is_number, node.elts))
    )


def constants_of(path: Path) -> list[str]:
    """Names in capitals that a module binds to numbers at its top level."""
    found = []
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            targets = [node.target]
        for target in targets:
            pairs = [(target, node.value)]
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=True))
            found += [
                name.id
                for name, value in pairs
                if isinstance(name, ast.Name) and name.id.isupper() and is_numeric(value)
            ]
    return found


def counts() -> dict[str, int]:
    """By room."""
    found: Counter[str] = Counter()
    for path in sorted(GAP.rglob("*.py")):
        found[path.relative_to(GAP).parts[0]] += len(constants_of(path))
    return dict(found)


def generate(app: Sphinx) -> None:
    """Write the table."""
    rows = ["| room | numbers in its modules |", "|---|---|"]
    by_room = counts()
    rows += [f"| `gap/{room}` | {number} |" for room, number in by_room.items()]
    held = len(json.loads((GAP / "answer" / "calibration.json").read_text(encoding="utf-8")))
    rows += [f"| together | {sum(by_room.values())} |", f"| `calibration.json` | {held} |"]
    TARGET.parent.mkdir(exist_ok=True)
    TARGET.write_text("\n".join(rows) + "\n", encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Count before Sphinx reads its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
