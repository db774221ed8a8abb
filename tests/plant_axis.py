"""An axis that a plant draws, and its clean records."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayes_hw.plant.case import Plant
from bayes_hw.plant.draws import draw_commands
from bayes_hw.plant.effects.effect import Scales
from bayes_hw.plant.kinds import Kind


def drawn_axis(plant: Plant, kind: Kind, seed: int) -> tuple[Any, float, list[np.ndarray], Scales]:
    """Axis, sigma of its noise, commands and sizes natural to both."""
    rng = np.random.default_rng(seed)
    axis, sigma, _, excitations, duration = plant.draw_axis(rng, kind)
    commands = draw_commands(rng, axis, excitations, duration)
    system = plant.nominal_of(axis)
    outputs = [system.simulate(u) for u in commands]
    return axis, sigma, commands, plant.scales(axis, commands, outputs, sigma, duration)
