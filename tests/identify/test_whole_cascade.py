"""How growth goes on where the noise model hides a misfit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
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
    pool, plain = whole_cascade._grown(experiment, structure, 9, lambda _: None)
    assert begun == starts and plain == (["small plain", "best plain"] if hidden else [])
    assert pool == [name for start in starts for name in (f"small {start}", f"best {start}")]


@pytest.mark.parametrize(
    ("carried", "grown", "taken"),
    [
        ([], ["small", "large"], "coloured"),
        (["coloured"], ["small", "large"], "large"),
        (["coloured", "large"], ["small", "large"], "enough of small, large"),
        (["coloured"], [], "coloured on plain residuals"),
    ],
)
def test_where_noise_carries_the_axis_another_is_taken(
    monkeypatch: pytest.MonkeyPatch, carried: list[str], grown: list[str], taken: str
) -> None:
    """The best grown on plain residuals where that simulates, else what is enough; without any grown so the
    chosen one is refitted."""

    def cascade(name: str) -> Any:
        return SimpleNamespace(name=name, structure=SimpleNamespace(integrator=True))

    def simulating(item: Any) -> Any:
        return cascade(f"{item.name} on plain residuals") if item.name in carried else item

    monkeypatch.setattr(whole_cascade, "_simulating", simulating)
    monkeypatch.setattr(whole_cascade, "chosen", lambda pool, *_: pool[-1])
    monkeypatch.setattr(
        whole_cascade,
        "_enough_to_simulate",
        lambda items: cascade("enough of " + ", ".join(item.name for item in items)),
    )
    found = whole_cascade._that_simulates(cascade("coloured"), [cascade(name) for name in grown])
    assert found.name == taken


def plain_cascade(order: int, pole: float, rms: float, samples: int = 400) -> Any:
    """Its fit on plain white residuals, all its poles but the integrator at `pole`."""
    residuals = (rms * np.random.default_rng(order).standard_normal(samples),)
    values = SimpleNamespace(real=np.full((2, order - 1), pole), sections=np.zeros((4, 0)))
    item = SimpleNamespace(
        structure=SimpleNamespace(order=order, n_linear=2 * order - 1),
        values=values,
        point=SimpleNamespace(rms=rms, residuals=residuals, samples=samples),
        response=SimpleNamespace(records=[np.zeros(samples)]),
    )
    item.on_plain_residuals = item
    return item


@pytest.mark.parametrize(
    ("rms", "poles", "order"),
    [
        ((1.0, 0.98, 0.975), (0.5, 0.5, 0.5), 2),
        ((1.0, 0.7, 0.69), (0.5, 0.5, 0.5), 3),
        ((1.0, 0.7, 0.1), (0.5, 0.5, 0.9999), 3),
        ((1.0, 0.7, 0.1), (0.9999, 0.9999, 0.9999), 4),
    ],
)
def test_the_smallest_cascade_that_serves_is_one_that_forgets_its_beginning(
    rms: tuple[float, ...], poles: tuple[float, ...], order: int
) -> None:
    """Better by little is not decisive; better by initial states that last is not better; where all last,
    the best is taken."""
    items = [plain_cascade(n, *one) for n, one in enumerate(zip(poles, rms, strict=True), start=2)]
    assert whole_cascade._enough_to_simulate(reversed(items)).structure.order == order
