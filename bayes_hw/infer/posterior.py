"""The posterior of one axis: draws, summaries and the files that hold them."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.files import staged, write_bytes_atomically, write_json
from bayes_hw.format_names import POSTERIOR
from bayes_hw.formats.hdf5_probe import is_sound_hdf5
from bayes_hw.identify.noise import NoiseEstimate, autoregression_from_partial
from bayes_hw.infer.convergence import Convergence
from bayes_hw.infer.dead_zone_trade import Trade
from bayes_hw.infer.noise import is_student_t, noise_order, noise_parameters
from bayes_hw.infer.reweighting import Reweighting
from bayes_hw.infer.summary import Summary, summarize
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import Parameter
from bayes_hw.record import Record

if TYPE_CHECKING:
    from xarray import DataTree

LIMITS = ("saturation.lower", "saturation.upper")
STORED_DRAWS = 40_000
MOST_DRAWS = 10_000_000
"""Most draws of a parameter that are read back."""

PRIOR_DRAWS = 2_000
PRIOR_DOMINATED_BELOW = 0.5
"""A contraction below this means that the records say little about the parameter beyond its prior."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of every parameter with what is needed to use them again.

    `values` has shape (ensembles, steps, walkers, parameters), `log_probability` the same without the last
    axis; `point_estimate` (parameters,) is where sampling started. `convergence` is None for a posterior
    read back from file, which keeps `converged` and `problems`. `failed_tests` say in words which tests of
    the residuals failed: a model that they refute. `reweighting` says how well something simpler stood in
    for the exact posterior, where it did; `trade` what trades places with the dead zone; `power` is that
    of the likelihood, below one where the model leaves far more than noise. None of these three is read
    back. `commanded` are the smallest and the largest command of the records, None where nobody said.
    """

    axis: AxisParameters
    noise_parameters: tuple[Parameter, ...]
    values: FloatArray
    log_probability: FloatArray
    point_estimate: FloatArray
    converged: bool
    problems: tuple[str, ...]
    seconds: float
    convergence: Convergence | None = None
    failed_tests: tuple[str, ...] = ()
    reweighting: Reweighting | None = None
    trade: Trade | None = None
    power: float = 1.0
    commanded: tuple[float, float] | None = None

    def __repr__(self) -> str:
        state = "converged" if self.converged else "NOT CONVERGED"
        return f"<Posterior of {self.axis.model.name!r}: {state}, draws {self.values.shape}>"

    @property
    def refuted_by(self) -> tuple[str, ...]:
        """What the tests of the residuals that failed mean, in words, without their names."""
        return tuple(failed.partition(": ")[2] or failed for failed in self.failed_tests)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*self.axis.parameters, *self.noise_parameters)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def unreached(self) -> tuple[str, ...]:
        """Limits beyond which nothing was commanded in most of the draws: their prior says how far."""
        if self.commanded is None:
            return ()
        low, high = self.commanded
        lower, upper = (np.median(self.chains(name)) for name in LIMITS)
        return tuple(name for name, met in zip(LIMITS, (lower > low, upper < high), strict=True) if not met)

    @property
    def conditional_on(self) -> tuple[str, ...]:
        """In words, what the same records estimated and these intervals take as known; empty for none."""
        held = ["the zeros and the other poles of G"] if self.axis.free == "conditional" else []
        return (*held, *(f"the poles of the response to {one.column}" for one in self.axis.model.known))

    @property
    def noise_order(self) -> int:
        return noise_order(self.noise_parameters)

    def chains(self, name: str) -> FloatArray:
        """Draws of one parameter, shape (ensembles, steps, walkers)."""
        return self.values[..., self.names.index(name)]

    @cached_property
    def summaries(self) -> dict[str, Summary]:
        """One summary a parameter, in the parameters' order."""
        return {p.name: summarize(self.values[..., i], p.unit) for i, p in enumerate(self.parameters)}

    @cached_property
    def contraction(self) -> dict[str, float]:
        """1 - sd^2 / (prior sd)^2 of every parameter: 1 where the records decide, 0 where the prior does."""
        levels = (np.arange(PRIOR_DRAWS) + 0.5) / PRIOR_DRAWS
        return {
            p.name: 1 - (self.summaries[p.name].sd / float(np.std(p.prior.quantile(levels)))) ** 2
            for p in self.parameters
        }

    @property
    def prior_dominated(self) -> tuple[str, ...]:
        """Parameters whose contraction is below PRIOR_DOMINATED_BELOW."""
        return tuple(name for name, value in self.contraction.items() if value < PRIOR_DOMINATED_BELOW)

    @cached_property
    def derived(self) -> dict[str, Summary]:
        """Summaries of what follows from the parameters: velocity gain and AR coefficients."""
        n_axis = len(self.axis.parameters)
        shape, flat = self.values.shape[:3], self.values.reshape(-1, self.values.shape[-1])
        found: dict[str, Summary] = {}
        if "gain" not in self.names:
            found["gain"] = summarize(self.axis.gain(flat[:, :n_axis].T).reshape(shape), "")
        for name, (draws, unit) in self.axis.known_strengths(flat[:, :n_axis].T).items():
            found[name] = summarize(draws.reshape(shape), unit)
        velocity = self.axis.velocity_gain(flat[:, :n_axis].T)
        if "velocity_gain" not in self.names and np.all(np.isfinite(velocity)):
            found["velocity_gain"] = summarize(velocity.reshape(shape), self.axis.model.units.velocity_gain)
        partial = flat[:, n_axis + 1 : n_axis + 1 + self.noise_order].T
        for i, coefficient in enumerate(autoregression_from_partial(partial), start=1):
            found[f"noise.autoregression{i}"] = summarize(coefficient.reshape(shape), "")
        innovation = flat[:, n_axis] * np.sqrt(np.prod(1 - partial**2, axis=0))
        found["noise.innovation_sigma"] = summarize(innovation.reshape(shape), self.axis.model.units.output)
        return found

    @property
    def reported(self) -> dict[str, Summary]:
        """The entries of posterior.json: the parameters and, where the weights of G's poles are sampled in
        its place, the gain; in the parameters' order, the gain after the static blocks."""
        names = list(self.summaries)
        if "gain" not in names:
            names.insert(names.index("dead_zone.half_width") + 1, "gain")
        found = self.summaries | self.derived
        at = names.index("noise.sigma")
        names[at:at] = [name for name in self.derived if name.startswith("known.")]
        return {name: found[name] for name in names}

    def draws(self, count: int, rng: np.random.Generator) -> FloatArray:
        """`count` draws without replacement (all of them if there are fewer), (count, parameters)."""
        flat = self.values.reshape(-1, self.values.shape[-1])
        chosen = rng.choice(len(flat), size=min(count, len(flat)), replace=False)
        return flat[chosen]

    def mean_model(self) -> HammersteinWiener:
        """The model at the posterior mean, its noise sigma included."""
        mean = self.values.mean(axis=(0, 1, 2))
        n_axis = len(self.axis.parameters)
        return replace(self.axis.to_model(mean[:n_axis]), noise_sigma=float(mean[n_axis]))

    def to_dict(self) -> dict[str, Any]:
        """The content of posterior.json."""
        return {
            "schema": POSTERIOR,
            "parameters": {name: summary.to_dict() for name, summary in self.reported.items()},
            "derived": {
                name: summary.to_dict() for name, summary in self.derived.items() if name not in self.reported
            },
            "converged": self.converged,
            "problems": list(self.problems),
            "failed_tests": list(self.failed_tests),
            "interval": "94 % highest-density interval",
            "priors": {p.name: p.prior.describe(p.unit) for p in self.parameters},
            "free": self.axis.free,
            "conditional_on": list(self.conditional_on),
            "unreached": list(self.unreached),
            "held_poles": list(self.axis.held_poles),
            "start": "rest" if self.axis.start_positions is None else "free",
            "ensembles": self.values.shape[0],
            "steps": self.values.shape[1],
            "walkers": self.values.shape[2],
            "seconds": self.seconds,
            **({} if self.power == 1.0 else {"likelihood_power": self.power}),
            **({} if self.reweighting is None else {self.reweighting.of: self.reweighting.to_dict()}),
            **({} if self.trade is None else {"dead_zone_trade": self.trade.to_dict()}),
        }

    def to_arviz(self, records: Sequence[Record] = ()) -> DataTree:
        """An ArviZ tree: posterior, prior, sample_stats, observed and constant data.

        Chains are the walkers of all ensembles; the coordinates `ensemble` and `walker` say which.
        """
        from arviz_base import from_dict

        ensembles, steps, walkers, _ = self.values.shape
        thin = max(1, -(-ensembles * steps * walkers // STORED_DRAWS))
        kept = np.moveaxis(self.values[:, ::thin], 1, 2).reshape(ensembles * walkers, -1, len(self.names))
        log_probability = np.moveaxis(self.log_probability[:, ::thin], 1, 2).reshape(ensembles * walkers, -1)
        levels = (np.arange(PRIOR_DRAWS) + 0.5) / PRIOR_DRAWS
        shuffled = np.random.default_rng(0)
        prior = {p.name: shuffled.permutation(p.prior.quantile(levels))[None, :] for p in self.parameters}
        data: dict[str, Any] = {
            "posterior": {name: kept[..., i] for i, name in enumerate(self.names)},
            "prior": prior,
            "sample_stats": {"lp": log_probability},
        }
        if records:
            data["observed_data"] = {f"y{i}": r.y for i, r in enumerate(records, start=1)}
            data["constant_data"] = {f"u{i}": r.u for i, r in enumerate(records, start=1)}
        tree = from_dict(data, check_conventions=False, attrs={"/": self._attributes(thin)})
        chain = {
            "ensemble": ("chain", np.repeat(np.arange(ensembles), walkers)),
            "walker": ("chain", np.tile(np.arange(walkers), ensembles)),
        }
        for group in ("posterior", "sample_stats"):
            tree[group] = tree[group].to_dataset().assign_coords(chain)
        for parameter in self.parameters:
            tree["posterior"][parameter.name].attrs["unit"] = parameter.unit
        return tree

    def write(self, folder: Path, records: Sequence[Record] = ()) -> None:
        """Write posterior.nc and posterior.json into `folder`, both or neither."""
        memory = io.BytesIO()
        self.to_arviz(records).to_netcdf(memory, engine="h5netcdf")
        content = self.to_dict()
        with staged(folder) as place:
            write_bytes_atomically(place / "posterior.nc", memory.getvalue())
            write_json(place / "posterior.json", content)

    @classmethod
    def read(cls, folder: Path | str) -> Posterior:
        """Read what `write` wrote. Raises InputError when it is missing, damaged or of another program."""
        path = Path(folder) / "posterior.nc"
        if not path.is_file():
            raise InputError(f"{path}: missing; give the --out folder of `bayes-hw sample`")
        if not is_sound_hdf5(path):
            raise InputError(f"{path}: damaged or not written by bayes-hw; sample again")
        import h5py

        try:
            with h5py.File(path, "r") as file:
                state = json.loads(file.attrs["bayes_hw"])
                names = state["names"]
                if len(set(names)) < len(names):
                    raise ValueError("a parameter twice")
                columns = [_stored(file["posterior"][name]) for name in names]
                log_probability = _stored(file["sample_stats"]["lp"])
            model = HammersteinWiener.from_dict(state["model"])
            start = state["start_positions"]
            if start is not None and not len(start):
                raise ValueError("no start positions")
            if not (0 < state["noise_sigma"] < np.inf and 0 < state["output_scale"] < np.inf):
                raise ValueError("a size that is not positive")
            if len(state["point_estimate"]) != len(names):
                raise ValueError("an estimate of other parameters")
            axis = AxisParameters(
                model,
                state["free"],
                output_scale=state["output_scale"],
                start_positions=None if start is None else np.array(start),
                held_poles=tuple(str(name) for name in state.get("held_poles", ())),
            )
            estimate = NoiseEstimate(
                state["noise_sigma"],
                np.array(state["noise_partial"]),
                state["noise_degrees_of_freedom"],
            )
            ensembles = int(state["ensembles"])
            values = np.moveaxis(
                np.stack(columns, axis=-1).reshape(ensembles, -1, columns[0].shape[1], len(names)), 2, 1
            )
            log_probability = np.moveaxis(log_probability.reshape(ensembles, -1, columns[0].shape[1]), 2, 1)
            if not np.isfinite(values).all():
                raise ValueError("draws that are not finite")
            posterior = cls(
                axis,
                noise_parameters(estimate, model.units.output),
                values,
                log_probability,
                np.array(state["point_estimate"]),
                bool(state["converged"]),
                tuple(str(problem) for problem in state["problems"]),
                float(state["seconds"]),
                failed_tests=tuple(str(test) for test in state.get("failed_tests", [])),
                commanded=_pair(state.get("commanded")),
            )
        except (OSError, LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RuntimeError):
            raise InputError(f"{path}: damaged or not written by bayes-hw; sample again") from None
        if posterior.names != tuple(names):
            raise InputError(f"{path}: written by another version of bayes-hw; sample again")
        return posterior

    def _attributes(self, thin: int) -> dict[str, str]:
        start = self.axis.start_positions
        sigma, *partial = self.noise_parameters[: self.noise_order + 1]
        student_t = is_student_t(self.noise_parameters)
        state = {
            "schema": POSTERIOR,
            "names": list(self.names),
            "model": self.axis.model.to_dict(),
            "free": self.axis.free,
            "held_poles": list(self.axis.held_poles),
            "output_scale": self.axis.output_scale,
            "start_positions": None if start is None else [float(value) for value in start],
            "noise_sigma": sigma.nominal,
            "noise_partial": [parameter.nominal for parameter in partial],
            "noise_degrees_of_freedom": self.noise_parameters[-1].nominal if student_t else None,
            "ensembles": int(self.values.shape[0]),
            "thinned_by": thin,
            "point_estimate": [float(value) for value in self.point_estimate],
            "converged": self.converged,
            "problems": list(self.problems),
            "failed_tests": list(self.failed_tests),
            "seconds": self.seconds,
            "commanded": None if self.commanded is None else list(self.commanded),
        }
        return {"bayes_hw": json.dumps(state)}


def _pair(stored: Any) -> tuple[float, float] | None:
    """Two numbers as stored, None where there are none; raises ValueError or TypeError on anything else."""
    if stored is None:
        return None
    low, high = map(float, stored)
    return low, high


def extremes(commands: Iterable[FloatArray]) -> tuple[float, float]:
    """The smallest and the largest of all commands, each of shape (samples,)."""
    ends = [(float(u.min()), float(u.max())) for u in commands]
    return min(low for low, _ in ends), max(high for _, high in ends)


def _stored(dataset: Any) -> FloatArray:
    """A stored variable as an array; raises ValueError where it declares more than MOST_DRAWS draws."""
    if dataset.size > MOST_DRAWS or dataset.is_virtual or dataset.external:
        raise ValueError("not a variable that bayes-hw writes")
    return np.asarray(dataset, dtype=np.float64)
