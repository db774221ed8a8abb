"""Which path explains most shows once what is not worth enough is taken out of all that may."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from bayes_hw.gap.joint.search import judged as module
from bayes_hw.gap.joint.search.followed_path import FollowedPath
from bayes_hw.gap.joint.search.joint_search import silent
from bayes_hw.gap.joint.search.judged import judged


@dataclass(eq=False)
class _Fit:
    """Stands for a fit: its score, its labels and the cause of its noise."""

    score: float
    labels: tuple[str, ...]
    cause: str | None = None
    added: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.added = () if self.cause is None else (self.cause,)

    @property
    def response(self) -> Any:
        return SimpleNamespace(cause=self.cause)


BARE: Any = _Fit(0.0, ())
READINGS: Any = SimpleNamespace(nats={})


def _path(fit: Any) -> FollowedPath:
    return FollowedPath(fit, BARE, READINGS)


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> dict[Any, Any]:
    """What verification leaves of fits; of others all."""
    left: dict[Any, Any] = {}

    def verified(fit: Any, *_: object) -> tuple[Any, dict[str, float]]:
        fit = left.get(fit, fit)
        return fit, dict.fromkeys(fit.labels, fit.score)

    monkeypatch.setattr(module, "verified", verified)
    return left


def test_a_path_that_loses_a_label_is_held_against_the_next_one(kept: dict[Any, Any]) -> None:
    """And one that explains no more as it is than another once judged need not be judged."""
    both, gap, weak = _Fit(300.0, ("friction", "wind")), _Fit(250.0, ("backlash",)), _Fit(200.0, ("other",))
    alone = kept[both] = _Fit(220.0, ("friction",))
    paths = [_path(one) for one in (weak, both, gap)]
    found = judged(paths, [], (), silent)
    assert list(found) == [paths[1], paths[2]]
    assert found[paths[1]].path.fit is alone and found[paths[1]].nats == {"friction": 220.0}
    assert max(found.values(), key=lambda one: one.path.gained).path.fit is gap


@pytest.mark.usefixtures("kept")
def test_the_likelier_cause_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """A walk that explains most by what its fit shows, and as a wind less than a friction does."""
    walk, wind = _Fit(300.0, ("sensor_drift",), "sensor_drift"), _Fit(120.0, ("wind",), "wind")
    rub = _Fit(150.0, ("friction",))
    monkeypatch.setattr(module, "likelier_cause", lambda *_: (wind, 80.0, [walk, wind]))
    paths = [_path(walk), _path(rub)]
    found = judged(paths, [], (), silent)
    assert list(found) == paths
    slow = found[paths[0]]
    assert slow.path.gained == 120.0 and slow.nats == {"wind": 120.0}
    assert slow.less_likely == {"sensor_drift": 40.0}
    assert [one.fit for one in slow.caused] == [walk, wind] and slow.caused[1] is slow.path
    assert found[paths[1]].path.gained == 150.0 and not found[paths[1]].caused


@pytest.mark.usefixtures("kept")
def test_a_cause_is_judged_though_another_path_explains_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """What its fit shows of a wind is less than its exact likelihood."""
    wind, exact = _Fit(240.0, ("wind",), "wind"), _Fit(350.0, ("wind",), "wind")
    curve, rub = _Fit(330.0, ("other",)), _Fit(250.0, ("friction",))
    monkeypatch.setattr(module, "likelier_cause", lambda *_: (exact, 10.0, [exact]))
    paths = [_path(one) for one in (curve, rub, wind)]
    found = judged(paths, [], (), silent)
    assert list(found) == [paths[0], paths[2]]
    assert max(found.values(), key=lambda one: one.path.gained).path.fit is exact
