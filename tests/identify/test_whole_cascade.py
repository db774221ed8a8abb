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
    monkeypatch.setattr(whole_cascade, "grow", grow)
    monkeypatch.setattr(whole_cascade, "absorbed", lambda item: hidden and item == "best coloured")
    monkeypatch.setattr(whole_cascade, "chosen", lambda pool, *_: pool[-1])
    monkeypatch.setattr(whole_cascade, "_simulating", lambda item: "another" if carried else item)
    experiment: Any = SimpleNamespace(records=(), noise_level=1.0)
    structure: Any = SimpleNamespace()
    pool, misfit = whole_cascade._grown(experiment, structure, 9, lambda _: None)
    assert begun == starts and misfit is hidden
    assert pool == [name for start in starts for name in (f"small {start}", f"best {start}")]
