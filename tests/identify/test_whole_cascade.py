"""How growth goes on where the noise model hides a misfit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayes_hw.identify import whole_cascade
from bayes_hw.identify.noise import MAX_ORDER


@pytest.mark.parametrize(
    ("hidden", "carried", "starts"),
    [
        (False, False, ["coloured"]),
        (True, False, ["coloured", "plain", "best plain"]),
        (True, True, ["coloured", "plain"]),
    ],
)
def test_growth_goes_on_from_the_best_on_plain_residuals(
    monkeypatch: pytest.MonkeyPatch, hidden: bool, carried: bool, starts: list[str]
) -> None:
    """Only where coloured noise hid a misfit, and not where it carries what the axis does there too."""
    begun: list[str] = []

    def smallest(*_: Any, most_noise: int = MAX_ORDER) -> str:
        return "coloured" if most_noise == MAX_ORDER else "plain"

    def grow(start: str, *_: Any) -> dict[int, str]:
        begun.append(start)
        return {1: f"small {start}", 2: f"best {start}"}

    monkeypatch.setattr(whole_cascade, "smallest_cascade", smallest)
    monkeypatch.setattr(whole_cascade, "_every_order", grow)
    monkeypatch.setattr(whole_cascade, "absorbed", lambda item: hidden and item == "best coloured")
    monkeypatch.setattr(whole_cascade, "chosen", lambda pool, *_: pool[-1])
    monkeypatch.setattr(whole_cascade, "_simulating", lambda item: "another" if carried else item)
    experiment: Any = SimpleNamespace(records=(), noise_level=1.0)
    structure: Any = SimpleNamespace()
    pool, resumed = whole_cascade._grown(experiment, structure, 9, lambda _: None)
    assert begun == starts and resumed == (["best plain"] if hidden else [])
    assert pool == [name for start in starts for name in (f"small {start}", f"best {start}")]


@pytest.mark.parametrize(
    ("carried", "resumed", "taken"),
    [
        (False, ["small", "large"], "coloured"),
        (True, ["small", "large"], "large on plain residuals without upper"),
        (True, [], "coloured on plain residuals"),
    ],
)
def test_where_noise_carries_the_axis_the_order_is_that_of_plain_residuals(
    monkeypatch: pytest.MonkeyPatch, carried: bool, resumed: list[str], taken: str
) -> None:
    """With the blocks that the chosen cascade has; where none was grown so, the chosen one is refitted."""

    def cascade(name: str, upper: bool) -> Any:
        blocks = SimpleNamespace(lower=True, upper=upper, dead_zone=True, integrator=True)
        return SimpleNamespace(name=name, structure=blocks)

    def simulating(item: Any) -> Any:
        if not carried:
            return item
        name, _, without = item.name.partition(" without")
        return cascade(f"{name} on plain residuals" + (f" without{without}" if without else ""), False)

    monkeypatch.setattr(whole_cascade, "_simulating", simulating)
    monkeypatch.setattr(whole_cascade, "chosen", lambda pool, *_: pool[-1])
    monkeypatch.setattr(
        whole_cascade, "_without", lambda item, block: cascade(f"{item.name} without {block}", False)
    )
    best = cascade("coloured", upper=False)
    found = whole_cascade._that_simulates(best, [cascade(name, True) for name in resumed])
    assert found.name == taken
