"""Settings of what is before and behind a simulator, by name: as a corrected simulator keeps them."""

from __future__ import annotations

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.settings import NEUTRAL as NEUTRAL

SIDES = sorted(S.COMMAND_SIDE | S.OUTPUT_SIDE)
NUMBER = {
    name: value
    for name, value in sorted(vars(S).items())
    if name.isupper() and isinstance(value, int) and value in SIDES
}
"""The settings' numbers by their names."""


def named_settings(settings: FloatArray) -> dict[str, float]:
    """Those of settings (COUNT,) that are not neutral."""
    return {name: float(settings[i]) for name, i in NUMBER.items() if settings[i] != NEUTRAL[i]}
