"""Slow noise with a second random cause beside it, in one likelihood.

A second cause says what it adds to the variance of every sample, infinite where a sample is no reading, and
the filter of the slow noise does the rest: any of them goes with any slow noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol, TypeAlias

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.stochastic_fit import StochasticFit

SlowNoise: TypeAlias = Callable[..., StochasticFit | None]
"""Slow noise of a `Misfit`, from a start of its parameters if given, beside known variances if given."""


class SecondCause(Protocol):
    """What a cause beside slow noise makes of the records of one misfit."""

    @property
    def label(self) -> str: ...

    @property
    def form(self) -> str:
        """The words by which the noise of both is told from that of one."""
        ...

    @property
    def rounds(self) -> int:
        """Times that it is estimated again beside the slow noise."""
        ...

    @property
    def misfit(self) -> Misfit:
        """What is left to the slow noise."""
        ...

    @property
    def variances(self) -> Sequence[FloatArray]:
        """Of what it adds (samples,), a record each, output units squared."""
        ...

    def log_likelihood(self, noise: StateNoise) -> float:
        """What the filter of slow `noise`, which was fitted beside it, does not see of it."""
        ...

    @property
    def parameters(self) -> dict[str, tuple[float, float, str]]:
        """Value, standard deviation and unit, by name."""
        ...

    def beside(self, noise: StateNoise) -> SecondCause:
        """Estimated again beside slow noise that was fitted beside it."""
        ...


FindSecond: TypeAlias = Callable[[Misfit], SecondCause | None]


def both(slow: SlowNoise, find_second: FindSecond) -> SlowNoise:
    """The noise of both causes; it finds None where the one or the other is not there."""

    def found(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
        second = find_second(fit)
        if second is None:
            return None
        for _ in range(second.rounds):
            alone = slow(second.misfit, start, second.variances)
            if alone is None or (noise := alone.whitener.with_states) is None:
                return None
            start, second = alone.point, second.beside(noise)
        alone = slow(second.misfit, start, second.variances)
        if alone is None or (noise := alone.whitener.with_states) is None:
            return None
        total = alone.log_likelihood + second.log_likelihood(noise)
        whitener = replace(noise, log_likelihood=total)
        held = replace(alone, whitener=whitener, log_likelihood=total)
        return held.with_second(second.label, second.form, second.parameters)

    return found
