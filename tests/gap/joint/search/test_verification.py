"""What a label must be worth when it is dropped."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayes_hw.gap.joint.noise.slow_noise import WIND
from bayes_hw.gap.joint.search import verification
from bayes_hw.gap.joint.search.verification import VERIFIED_BESIDE_NATS, VERIFIED_NATS, asked_of


@pytest.mark.parametrize(
    ("without", "beside", "kept"), [(100.0, 0.0, True), (20.0, 0.0, False), (41.0, 39.0, False)]
)
def test_a_label_is_held_against_what_would_be_said_without_it(
    without: float, beside: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A few nats over a cause without a name keep one that takes the colour away; over nothing at all they do
    not, nor where the colour stays but for a trace."""
    fit: Any = SimpleNamespace(labels=("wind",), noise_order=1, score=117.0, observer=None)
    plain: Any = SimpleNamespace(labels=(), noise_order=12, score=100.0, observer=None)
    fit.response = plain.response = SimpleNamespace(weights=None, cause=WIND)
    fit.without = lambda _: plain
    monkeypatch.setattr(verification, "regrown", lambda one: one)
    monkeypatch.setattr(verification, "coloured_nats", lambda one: without if one is plain else beside)
    monkeypatch.setattr(verification, "leaves_a_cause", lambda one: verification.coloured_nats(one) > 40)
    readings: Any = SimpleNamespace(nats={})
    found, nats = verification.verified(fit, plain, [], readings, lambda _: None)
    assert (found is fit) == kept
    assert nats == ({"wind": 17.0} if kept else {})


def test_more_is_asked_where_noise_has_a_cause_beside_an_effect() -> None:
    """Whatever is added to G itself; and where noise is of higher order, or readings are faulty."""
    sound: Any = SimpleNamespace(nats={})
    rounded: Any = SimpleNamespace(nats={"encoder_quantization": 100.0})

    def fit(labels: tuple[str, ...], cause: str | None, order: int = 1, observer: int | None = None) -> Any:
        response = SimpleNamespace(cause=cause)
        return SimpleNamespace(
            labels=labels, noise_order=order, response=response, observer=observer, score=400.0
        )

    base = fit((), None)

    assert asked_of(fit(("friction",), None), base, sound) == VERIFIED_NATS
    assert asked_of(fit(("wind",), WIND), base, sound) == VERIFIED_NATS
    assert asked_of(fit(("transport_delay", "friction"), None), base, sound) == VERIFIED_NATS
    assert asked_of(fit(("wind", "friction"), WIND), base, sound) == VERIFIED_BESIDE_NATS
    assert asked_of(fit(("friction",), None, order=5), base, sound) == VERIFIED_BESIDE_NATS
    assert asked_of(fit(("friction",), None, observer=0), base, sound) == VERIFIED_BESIDE_NATS
    assert asked_of(fit(("friction",), None), base, rounded) == VERIFIED_BESIDE_NATS


@pytest.mark.parametrize(("second", "kept"), [(67.0, False), (304.0, True)])
def test_what_mends_the_form_of_an_explanation_is_no_label(
    second: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A label beside one that gains thousands of nats must be worth a share of them; alone it need not."""
    response: Any = SimpleNamespace(weights=None, cause=None)

    def fit(labels: tuple[str, ...], score: float) -> Any:
        return SimpleNamespace(labels=labels, noise_order=1, score=score, observer=None, response=response)

    base, alone, other = fit((), 0.0), fit(("backlash",), 2000.0), fit(("friction",), 400.0)
    both = fit(("backlash", "friction"), 2000.0 + second)
    both.without = lambda label: alone if label == "friction" else other
    alone.without = other.without = lambda _: base
    monkeypatch.setattr(verification, "regrown", lambda one: one)
    monkeypatch.setattr(verification, "leaves_a_cause", lambda _: False)
    readings: Any = SimpleNamespace(nats={})
    answer, nats = verification.verified(both, base, [], readings, lambda _: None)
    assert answer is (both if kept else alone)
    assert nats["backlash"] >= 1600
    assert asked_of(other, base, readings) == VERIFIED_NATS


@pytest.mark.parametrize("worth", [100.0, 200.0])
def test_what_readings_follow_is_held_against_their_following(
    worth: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In observer form they follow any torque: a label that is worth less than that is none of its causes."""
    bare: Any = SimpleNamespace(labels=(), noise_order=12, score=100.0, observer=None)
    following: Any = SimpleNamespace(labels=(), noise_order=3, score=250.0, observer=0)
    fit: Any = SimpleNamespace(labels=("torque_ripple",), noise_order=1, score=250.0 + worth, observer=0)
    fit.response = bare.response = following.response = SimpleNamespace(weights=None, cause=None)
    fit.without = lambda _: following
    monkeypatch.setattr(verification, "regrown", lambda one: one)
    monkeypatch.setattr(verification, "leaves_a_cause", lambda one: one is not fit)
    readings: Any = SimpleNamespace(nats={})
    kept, nats = verification.verified(fit, bare, [], readings, lambda _: None)
    assert (kept, nats) == ((fit, {"torque_ripple": worth}) if worth > 150 else (bare, {}))
