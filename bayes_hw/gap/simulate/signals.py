"""Signals of base models of either kind: the compiled chain of a drive train, or any simulator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias, cast

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.builder import SignalChain
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.chain_batch import Followed, KnownPositions, simulate_chains
from bayes_hw.gap.simulate.injection_point import InjectionPoint
from bayes_hw.gap.simulate.simulator_chain import SimulatorChain, simulate_simulators
from bayes_hw.gap.simulate.small_signals import small_responses

Signals: TypeAlias = tuple[FloatArray, FloatArray]
"""w and y of one record, both (samples, chains)."""


def simulate_signals(
    chains: Sequence[SignalChain],
    settings: FloatArray,
    inputs: Sequence[FloatArray],
    keep_w: bool = False,
    known: KnownPositions | None = None,
    followed: Followed | None = None,
) -> list[Signals]:
    """Signals of every record under every chain, all of one kind, and its row of `settings` (chains, COUNT).

    `inputs` holds the commands (samples,), one a record. Without `keep_w` the w may have no samples.
    `known` says where ripple of a drive train acts if not at the simulated position.
    """
    if isinstance(chains[0], SimulatorChain):
        return simulate_simulators(cast("Sequence[SimulatorChain]", chains), settings, inputs)
    compiled = cast("Sequence[Chain]", chains)
    return [(w, y) for w, y in simulate_chains(compiled, settings, inputs, keep_w, known, followed)]


def has_door(chain: SignalChain, door: InjectionPoint) -> bool:
    """Whether signals can be added at `door`: a user's simulator may take no force."""
    if not isinstance(chain, SimulatorChain) or door in ("command", "output"):
        return True
    return door == "motor_torque" and chain.simulator.force_door


def door_responses(chain: SignalChain, door: InjectionPoint, signals: FloatArray) -> FloatArray:
    """Change of w (samples, n) for `signals` (samples, n) added at `door`, each held over its sample."""
    if isinstance(chain, SimulatorChain):
        return chain.small_responses(door, signals)
    return small_responses(cast("Chain", chain), door, signals)
