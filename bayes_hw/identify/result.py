"""What an identification found, and how it writes itself to fit.json."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.linear_output_error import OrderCandidate
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.identify.structure_pool import StructurePool
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock

SCHEMA = "bayes-hw/fit/1"


@dataclass(frozen=True, eq=False)
class LinearModel:
    """y = G (u + input_offset): the linear baseline, from rest at y = `initial_position`."""

    linear: LinearBlock
    input_offset: float

    def simulate(self, u: FloatArray, initial_position: float = 0.0) -> FloatArray:
        """Noise-free response to the command u, shape (samples,), from rest."""
        command = np.asarray(u, dtype=np.float64)
        undelayed = replace(self.linear, delay_samples=0)
        constant = np.full(len(command), self.input_offset)
        return self.linear.filter(command) + undelayed.filter(constant) + initial_position


@dataclass(frozen=True, eq=False)
class Cascade:
    """A fitted cascade in modal coordinates, in the records' units: what both models are simulated from."""

    structure: Structure
    values: CascadeValues


@dataclass(frozen=True, eq=False)
class Step:
    """One of the four steps: what it did, the root mean square output error `cost` that it left (output
    units), the fit percentage over all records together, its G, and its limits and half width, None where
    it has none.
    """

    name: str
    description: str
    cost: float
    fit_percent: float
    linear: LinearBlock
    lower: float | None
    upper: float | None
    half_width: float | None


@dataclass(frozen=True, eq=False)
class Rebuilt:
    """A rebuilt relation for a figure: `abscissa` and `ordinate` of one length."""

    abscissa: FloatArray
    ordinate: FloatArray


@dataclass(frozen=True)
class Shown:
    """Whether the records show a block, and why that is said."""

    shown: bool
    reason: str


@dataclass(frozen=True)
class RecordFit:
    """Fit percentages (eq. 14) of both models on one record."""

    record: str
    hammerstein_wiener: float
    linear: float


@dataclass(frozen=True, eq=False)
class Identification:
    """The four-step estimate of one axis from its records.

    `input_curve` is f(u) rebuilt in step 2 on hinges, `output_cloud` y against the w of step 3.
    `blocks_shown` has the keys saturation.lower, saturation.upper and dead_zone: a limit not shown stands
    in `model` at the largest command seen on its side, a dead zone not shown at zero width. `orders` are
    the candidates of the whole cascade, `linear_orders` those of the baseline. `residuals` are measured
    minus simulated y, one array per record.
    """

    model: HammersteinWiener
    baseline: LinearModel
    cascade: Cascade
    baseline_cascade: Cascade
    steps: tuple[Step, ...]
    input_curve: Rebuilt
    output_cloud: Rebuilt
    orders: tuple[OrderCandidate, ...]
    linear_orders: tuple[OrderCandidate, ...]
    fits: tuple[RecordFit, ...]
    blocks_shown: dict[str, Shown]
    noise: NoiseEstimate
    residuals: tuple[FloatArray, ...]
    warnings: tuple[str, ...]
    pool: StructurePool

    def to_dict(self) -> dict[str, Any]:
        """The content of fit.json, units as in the records."""
        return {
            "schema": SCHEMA,
            "model": self.model.to_dict(),
            "linear_baseline": {
                "linear": _linear_dict(self.baseline.linear),
                "input_offset": self.baseline.input_offset,
            },
            "steps": [
                {
                    "name": step.name,
                    "description": step.description,
                    "cost": step.cost,
                    "fit_percent": step.fit_percent,
                    "linear": _linear_dict(step.linear),
                    "saturation": {"lower": step.lower, "upper": step.upper},
                    "dead_zone": {"half_width": step.half_width},
                }
                for step in self.steps
            ],
            "input_curve": _rebuilt_dict(self.input_curve, "u", "v"),
            "output_cloud": _rebuilt_dict(self.output_cloud, "w", "y"),
            "orders": [asdict(candidate) for candidate in self.orders],
            "structure": self.pool.to_dict(),
            "linear_orders": [asdict(candidate) for candidate in self.linear_orders],
            "fits": [asdict(fit) for fit in self.fits],
            "blocks_shown": {key: asdict(value) for key, value in self.blocks_shown.items()},
            "noise": {
                "sigma": self.noise.sigma,
                "autoregression": self.noise.autoregression.tolist(),
            },
            "warnings": list(self.warnings),
        }


def _linear_dict(linear: LinearBlock) -> dict[str, Any]:
    return {
        "zeros": [[z.real, z.imag] for z in linear.zeros.tolist()],
        "poles": [[p.real, p.imag] for p in linear.poles.tolist()],
        "gain": linear.gain,
        "delay_samples": linear.delay_samples,
    }


def _rebuilt_dict(rebuilt: Rebuilt, abscissa: str, ordinate: str) -> dict[str, Any]:
    return {abscissa: rebuilt.abscissa.tolist(), ordinate: rebuilt.ordinate.tolist()}
