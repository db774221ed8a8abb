"""Numbers that stand in modules, counted by room: docs/generated/constants.txt."""

from __future__ import annotations

import ast
import json
from collections import Counter
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).resolve().parents[1]
PACKAGE = HERE.parent / "bayes_hw"
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


def room_of(path: Path) -> str:
    """The room of a module: that of the diagnosis by its own rooms, the top level as one."""
    parts = path.relative_to(PACKAGE).parts
    if parts[0] == "gap":
        return "/".join(parts[: 3 if parts[1] == "joint" else 2][: len(parts) - 1])
    return parts[0] if len(parts) > 1 else "top level"


def counts() -> dict[str, int]:
    """By room; rooms without any are left out."""
    found: Counter[str] = Counter()
    for path in sorted(PACKAGE.rglob("*.py")):
        found[room_of(path)] += len(constants_of(path))
    return {room: number for room, number in sorted(found.items()) if number}


def calibrated() -> dict[str, int]:
    """How many numbers each file of fitted constants holds."""
    files = sorted((PACKAGE / "gap").rglob("*calibration.json"))
    return {
        str(path.relative_to(PACKAGE)): len(json.loads(path.read_text(encoding="utf-8"))) for path in files
    }


def generate(app: Sphinx) -> None:
    """Write the table."""
    rows = ["| room | numbers in its modules |", "|---|---|"]
    by_room = counts()
    rows += [f"| `{room}` | {number} |" for room, number in by_room.items()]
    diagnosis = sum(number for room, number in by_room.items() if room.split("/")[0] == "gap")
    rows += [f"| together | {sum(by_room.values())} |", f"| of them in `gap` | {diagnosis} |"]
    rows += [f"| `{path}` | {number} |" for path, number in calibrated().items()]
    TARGET.parent.mkdir(exist_ok=True)
    TARGET.write_text("\n".join(rows) + "\n", encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Count before Sphinx reads its sources."""
    app.connect("builder-inited", generate)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
