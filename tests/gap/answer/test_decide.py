"""The decision from hand-made evidences."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from decision_constants import CONSTANTS, LABELS
from drive_axis import drive_axis
from own_simulators import motor

from bayes_hw.gap.answer.decide import best_of_sets, choose, decide, remains_of, score
from bayes_hw.gap.criticism.residual_diagnostics import ResidualDiagnostic
from bayes_hw.gap.fit.explanation import is_far_ahead
from bayes_hw.gap.noise.stochastic_fit import StochasticFit
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.simulate.chain_builder import ChainBuilder
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder

SURPRISES = {"input": 2.0, "linear": 60.0, "drive": 4.0, "disturbance": 0.0, "sensor": 1.0}
AXIS = ChainBuilder(drive_axis())
OWN_SIMULATOR = SimulatorBuilder(motor())


@dataclass
class Stub:
    """As much of an explanation as a decision looks at."""

    labels: tuple[str, ...]
    log_evidence: float
    rmse: float = 1.0
    encoder_sigma: float = 1.0
    stochastic: Any = None
    chaotic: bool = False
    chaotic_response: bool = False
    at_odds_with_prior: bool = False
    unheard_of: tuple[str, ...] = ()
    display: Any = None
    bent_disturbance: float = 0.0
    followed: Any = None
    builder: Any = OWN_SIMULATOR
    cause_of_noise: Any = None

    @property
    def drifts(self) -> bool:
        return self.stochastic is not None and self.stochastic.drifts

    @property
    def cannot_be_predicted(self) -> bool:
        return self.chaotic or self.followed is not None

    @property
    def fit(self) -> Any:
        return SimpleNamespace(
            rmse=self.rmse,
            residuals=[np.zeros(1000)],
            whitener=SimpleNamespace(sigma=self.encoder_sigma),
            hypothesis=SimpleNamespace(builder=self.builder, effects=()),
        )


def slow(label: str, size: float) -> StochasticFit:
    """Slow noise of that size."""
    return StochasticFit(label, "", Plain(1.0), 0.0, {}, size=size)


def chosen(*stubs: Stub, nominal: float = 1.0) -> tuple[str, ...]:
    return choose(SimpleNamespace(explanations=stubs), nominal, CONSTANTS)[0].labels  # type: ignore[arg-type]


def test_the_best_form_stands_for_its_label() -> None:
    stubs = [Stub((), 0), Stub(("friction",), 20), Stub(("friction",), 30), Stub(("wind",), 5)]
    best = best_of_sets(SimpleNamespace(explanations=stubs))  # type: ignore[arg-type]
    assert {key: value.log_evidence for key, value in best.items()} == {
        (): 0, ("friction",): 30, ("wind",): 5,
    }  # fmt: skip


def test_no_more_than_two_effects_are_judged() -> None:
    stubs = [Stub((), 0), Stub(("backlash", "outliers"), 300), Stub(("backlash", "outliers", "wind"), 900)]
    best = best_of_sets(SimpleNamespace(explanations=stubs))  # type: ignore[arg-type]
    assert list(best) == [("backlash", "outliers"), ()]


@pytest.mark.parametrize(("evidence", "counted"), [(350.0, 350.0), (345.0, 300.0)])
def test_lost_motion_counts_only_far_ahead_of_all_that_can_be_predicted(
    evidence: float, counted: float
) -> None:
    lost = Stub(("backlash",), evidence, chaotic=True, chaotic_response=True)
    stubs = [Stub((), 0), Stub(("backlash",), 300, chaotic=True), lost, Stub(("friction",), 299)]
    best = best_of_sets(SimpleNamespace(explanations=stubs))  # type: ignore[arg-type]
    assert best["backlash",].log_evidence == counted
    assert is_far_ahead(stubs) == (counted == evidence)  # type: ignore[arg-type]


@pytest.mark.parametrize(("evidence", "counted"), [(351.0, 351.0), (345.0, 300.0)])
def test_so_does_motion_that_had_to_be_followed(evidence: float, counted: float) -> None:
    """A spring that jumps: the free simulation counts unless what was followed is far ahead of it."""
    followed = Stub(("cubic_stiffness",), evidence, chaotic_response=True, followed="measured")
    stubs = [Stub((), 0), Stub(("cubic_stiffness",), 300), followed, Stub(("friction",), 299)]
    best = best_of_sets(SimpleNamespace(explanations=stubs))  # type: ignore[arg-type]
    assert best["cubic_stiffness",].log_evidence == counted


@pytest.mark.parametrize(("chaotic", "far_ahead", "answer"), [
    (True, True, ("backlash",)), (True, False, ("other",)), (False, True, ("other",)),
])  # fmt: skip
def test_what_chaos_far_ahead_leaves_is_no_other_cause(
    chaotic: bool, far_ahead: bool, answer: tuple[str, ...]
) -> None:
    best, left = Stub(("backlash",), 300, chaotic=chaotic), [ResidualDiagnostic("step", 1000.0, 3.0)]
    scores = {(): 0.0, ("backlash",): 300.0}
    remains = remains_of(Stub((), 0), best, left, SURPRISES, far_ahead)  # type: ignore[arg-type]
    decision = decide(best, scores, remains, LABELS, CONSTANTS)  # type: ignore[arg-type]
    assert decision.answer == answer
    assert decision.leftovers == tuple(left)


@pytest.mark.parametrize(
    ("unheard_of", "answer"),
    [((), ("unmodelled_mode",)), (("unmodelled_mode.damping_ratio",), ("other",))],
)
def test_what_has_numbers_that_are_unheard_of_is_no_answer(
    unheard_of: tuple[str, ...], answer: tuple[str, ...]
) -> None:
    best = Stub(("unmodelled_mode",), 300, unheard_of=unheard_of)
    remains = remains_of(Stub((), 0), best, [], {**SURPRISES, "linear": 300.0})  # type: ignore[arg-type]
    scores = {(): 0.0, ("unmodelled_mode",): 300.0}
    decision = decide(best, scores, remains, LABELS, CONSTANTS)  # type: ignore[arg-type]
    assert decision.answer == answer


@pytest.mark.parametrize(("gain", "answer"), [(9.0, ()), (11.0, ("friction",))])
def test_an_effect_must_earn_its_name(gain: float, answer: tuple[str, ...]) -> None:
    assert chosen(Stub((), 0), Stub(("friction",), gain), Stub(("backlash",), gain - 5)) == answer


@pytest.mark.parametrize(
    ("evidence", "rmse", "answer"),
    [
        (55.0, 0.5, ("backlash", "friction")),
        (48.0, 0.5, ("friction",)),
        (55.0, 0.98, ("friction",)),
    ],
)
def test_both_of_a_pair_must_earn_their_places(evidence: float, rmse: float, answer: tuple[str, ...]) -> None:
    """In evidence against the better single, and in error removed."""
    singles = [Stub(("friction",), 40, rmse=1.0), Stub(("backlash",), 30, rmse=1.2)]
    assert chosen(Stub((), 0, rmse=2.0), *singles, Stub(("backlash", "friction"), evidence, rmse)) == answer


@pytest.mark.parametrize(("gap", "named"), [(4.0, 2), (6.2, 1)])
def test_the_second_effect_must_take_a_share_of_the_gap(gap: float, named: int) -> None:
    """0.49 times the noise in error removed (1.1 squared less 0.985 squared): of a gap of 4 it is more than a
    tenth, of 6.2 less. What a wrong first effect leaves grows with the gap."""
    friction, backlash = Stub(("friction",), 400, rmse=1.1), Stub(("backlash",), 30, rmse=0.9 * gap)
    both = Stub(("backlash", "friction"), 500, rmse=0.985)
    assert len(chosen(Stub((), 0, rmse=gap), friction, backlash, both)) == named


@pytest.mark.parametrize(("single", "pair", "named"), [(True, False, 2), (True, True, 1), (False, False, 1)])
def test_error_removed_does_not_count_where_a_base_far_off_made_up_for_it(
    single: bool, pair: bool, named: int
) -> None:
    """One effect alone does nearly as well as two, but only with base parameters that no nominal has."""
    friction = Stub(("friction",), 40, rmse=1.0, at_odds_with_prior=single)
    backlash = Stub(("backlash",), 30, rmse=1.2)
    both = Stub(("backlash", "friction"), 55, rmse=0.99, at_odds_with_prior=pair)
    assert len(chosen(Stub((), 0, rmse=2.0), friction, backlash, both)) == named


@pytest.mark.parametrize(("evidence", "strained", "alone_too", "answer"), [
    (260, False, False, ("backlash", "friction")),
    (240, False, False, ("backlash",)),
    (260, True, False, ("backlash",)),
    (260, True, True, ("backlash", "friction")),
    (240, True, True, ("backlash",)),
])  # fmt: skip
def test_beside_chaos_a_second_effect_must_be_far_ahead(
    evidence: float, strained: bool, alone_too: bool, answer: tuple[str, ...]
) -> None:
    """By more than small changes of a chaotic motion make, and without base parameters that either effect
    alone does not need as far off."""
    wind = slow("wind", 4.0)
    lost = {"rmse": 4.0, "stochastic": wind, "chaotic": True, "chaotic_response": True}
    alone = Stub(("backlash",), 200, at_odds_with_prior=alone_too, **lost)
    both = Stub(("backlash", "friction"), evidence, at_odds_with_prior=strained, **lost)
    friction = Stub(("friction",), 100, at_odds_with_prior=alone_too)
    assert chosen(Stub((), 0), alone, friction, both) == answer


def test_rounded_data_are_rounded() -> None:
    """A lattice is a fact: it is chosen however the evidences compare."""
    rounded = ("encoder_quantization",)
    assert chosen(Stub((), 0), Stub(rounded, -50), Stub(("friction",), 40)) == rounded


def test_noise_unlike_the_nominal_counts_against_an_explanation() -> None:
    """Half the square of the log-ratio in standard deviations; bounded; nothing where none is nominal."""
    twice = Stub((), 100, encoder_sigma=2.0)
    assert score(twice, 1.0, CONSTANTS) == pytest.approx(100 - 0.5 * (0.6931472 / 0.25) ** 2)
    assert score(Stub((), 100, encoder_sigma=1e9), 1.0, CONSTANTS) == pytest.approx(-100)
    assert score(twice, float("nan"), CONSTANTS) == 100


def test_what_even_a_right_explanation_may_leave() -> None:
    """A share of the gap, a larger one where the motion is chaotic or the display repeats or rounds."""
    base, plain = Stub((), 0, rmse=5.0), Stub(("friction",), 9, rmse=1.0)
    chaotic = Stub(("backlash",), 9, rmse=1.0, chaotic=True)
    rounded = Stub(("timing_jitter",), 9, rmse=1.0, display=object())
    gap = 24**0.5
    assert expected(base, plain) == pytest.approx(CONSTANTS.left_share * gap)
    bent = Stub(("cubic_stiffness", "wind"), 9, rmse=1.0, bent_disturbance=3.0)
    assert expected(base, bent) == pytest.approx(np.hypot(CONSTANTS.left_share * gap, 0.2 * 3.0))
    assert expected(base, chaotic) == expected(base, rounded) == pytest.approx(CONSTANTS.loose_share * gap)


@pytest.mark.parametrize(("labels", "builder", "random", "blocks"), [
    (("backlash", "command_bias"), AXIS, False, ("drive", "input")), ((), AXIS, False, ()),
    (("backlash", "wind"), AXIS, True, ()), (("backlash",), OWN_SIMULATOR, False, ()),
    (("hot_drive",), AXIS, False, ()),
])  # fmt: skip
def test_names_are_held_against_blocks_on_axes(
    labels: tuple[str, ...], builder: Any, random: bool, blocks: tuple[str, ...]
) -> None:
    """Not where a random or chaotic one is named, nor of a user's simulator or another package's effect."""
    stub = Stub(labels, 9, builder=builder, cause_of_noise=random or None)
    remains = remains_of(Stub((), 0), stub, [], SURPRISES)  # type: ignore[arg-type]
    assert remains.named == blocks
    lost = replace(stub, chaotic=True)
    assert remains_of(Stub((), 0), lost, [], SURPRISES).named == ()  # type: ignore[arg-type]
    assert max(remains.blocks, key=lambda block: remains.blocks[block]) == "linear"


def test_an_effect_elsewhere_than_the_cause_is_not_believed() -> None:
    """Functions at the linear block take far more than any of the drive, where backlash would enter."""
    scores = {(): 0.0, ("backlash",): 300.0}
    stub = Stub(("backlash",), 300, builder=AXIS)
    for drive, answer in ((4.0, ("other",)), (40.0, ("backlash",))):
        remains = remains_of(Stub((), 0), stub, [], {**SURPRISES, "drive": drive})  # type: ignore[arg-type]
        assert decide(stub, scores, remains, LABELS, CONSTANTS).answer == answer  # type: ignore[arg-type]


def test_what_functions_take_of_chaos_is_a_share_of_its_evidence() -> None:
    """60 nats of 300; nothing where the motion is predicted or beside a second effect."""
    lost = Stub(("backlash",), 300, chaotic=True)
    others = (replace(lost, chaotic=False), replace(lost, labels=("backlash", "friction")))
    shares = [remains_of(Stub((), 0), s, [], SURPRISES).predicted for s in (lost, *others)]  # type: ignore[arg-type]
    assert shares == [pytest.approx(0.2), 0.0, 0.0]


def expected(base: Stub, explanation: Stub) -> float:
    return remains_of(base, explanation, [], SURPRISES).expected(CONSTANTS)  # type: ignore[arg-type]


def test_under_slow_noise_the_innovations_tell() -> None:
    """A response beside a drift is earned by evidence a sample: plain errors hold the drift too."""

    def drifting(labels: tuple[str, ...], log_evidence: float, rmse: float) -> Stub:
        noise = slow("sensor_drift", 2.0)
        return Stub(labels, log_evidence, rmse=rmse, stochastic=noise)

    base, alone = Stub((), 0.0, rmse=4.0), drifting(("sensor_drift",), 500.0, 1.8)
    pair = ("friction", "sensor_drift")
    assert chosen(base, alone, drifting(pair, 530.0, 2.9)) == pair
    assert chosen(base, alone, drifting(pair, 504.0, 2.9)) == ("sensor_drift",)
