"""What study 06 measures: the twin's posterior, axes of more modes, and how each is timed."""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit
from twin import coloured_noise, twin_records

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import effective_sample_size
from bayes_hw.infer.inference import axis_for
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import StartingPoint, starting_point
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.lanes import LANES, load, store
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record

SAMPLE_RATE_HZ = 20.0
PEAK_LOOPS = 100_000


@dataclass(frozen=True, eq=False)
class Case:
    """A log-posterior with its starting point."""

    target: LogPosterior
    start: StartingPoint
    start_seconds: float

    @property
    def reparameterisation(self) -> Reparameterisation:
        found = Reparameterisation.of(self.target.parameters, self.target.records)
        assert found is not None
        return found

    @property
    def straight(self) -> Laplace:
        """The Laplace approximation in straight coordinates."""
        mode = (self.start.coordinates, self.start.covariance)
        return Laplace([mode], [self.target]).carried(self.reparameterisation)

    def cloud(self, walkers: int, seed: int) -> FloatArray:
        """Points (walkers, parameters) about the mode, of 0.3 times the posterior's width."""
        rng = np.random.default_rng(seed)
        shifts = rng.standard_normal((walkers, self.target.dimension))
        return self.start.coordinates + 0.3 * shifts @ np.linalg.cholesky(self.start.covariance).T

    def sample(self, settings: SamplerSettings, seed: int) -> tuple[Sampling, float]:
        """A run, and the CPU seconds that it took, pilot and diagnostics included."""
        begin = time.process_time()
        found = sample(
            lambda: LogPosterior(self.target.axis, self.start.noise_parameters, self.target.records),
            self.start.coordinates,
            self.start.covariance,
            np.random.default_rng(seed),
            settings=settings,
            others=self.start.others,
            reparameterisation=self.reparameterisation,
        )
        return found, time.process_time() - begin


def case_of(model: HammersteinWiener, records: Sequence[Record], seed: int) -> Case:
    """The posterior of the dominant parameters given some records, started as `infer` does."""
    axis = axis_for(model, records, "conditional", "rest")
    begin = time.process_time()
    start = starting_point(axis, records, np.random.default_rng(seed))
    seconds = time.process_time() - begin
    return Case(LogPosterior(axis, start.noise_parameters, records), start, seconds)


def twin_case(seed: int, records: int | None = None) -> Case:
    """The twin's training records, all three or the first `records`, of 2,400 samples; ten parameters."""
    twin = twin_records(np.random.default_rng(seed))
    return case_of(twin.truth, twin.train[:records], seed)


def repeated(case: Case, samples: int) -> LogPosterior:
    """The posterior with its record repeated to `samples` samples: only its cost is of interest."""
    record = case.target.records[0]
    times = -(-samples // len(record))
    u, y = np.tile(record.u, times)[:samples], np.tile(record.y, times)[:samples]
    longer = Record("repeated", np.arange(samples) / SAMPLE_RATE_HZ, u, y, SAMPLE_RATE_HZ, record.units)
    return LogPosterior(case.target.axis, case.target.noise, [longer])


def axis_of_modes(modes: int, samples: int, seed: int) -> tuple[HammersteinWiener, Record]:
    """An integrator and `modes` modes between 1 and 8 Hz with antiresonances between them, driven by random
    steps through both limits; six parameters and two a mode."""
    rng = np.random.default_rng(seed)
    frequencies = np.geomspace(1.0, 8.0, modes) if modes > 1 else np.full(modes, 2.0)
    found = tuple(Mode(float(f), 0.06) for f in frequencies)
    between = tuple(Mode(float(f), 0.06) for f in np.sqrt(frequencies[1:] * frequencies[:-1]))
    pairs = np.array([mode.pole(SAMPLE_RATE_HZ) for mode in found], dtype=np.complex128)
    zeros = np.array([mode.pole(SAMPLE_RATE_HZ) for mode in between], dtype=np.complex128)
    poles = np.concatenate([[1.0 + 0j], pairs, pairs.conj()])
    gain = 0.05 * np.prod(np.abs(1 - pairs) ** 2) / np.prod(np.abs(1 - zeros) ** 2)
    linear = LinearBlock(np.concatenate([zeros, zeros.conj()]), poles, float(gain), 1)
    model = HammersteinWiener(
        f"{modes} modes",
        SAMPLE_RATE_HZ,
        Saturation(-0.8, 1.0),
        linear,
        DeadZone(0.02),
        found,
        noise_sigma=0.01,
    )
    u = np.repeat(rng.normal(0.0, 0.9, size=-(-samples // 8)), 8)[:samples]
    y = model.simulate(u).y + coloured_noise(rng, samples, 0.01, 0.5)
    return model, Record("steps", np.arange(samples) / SAMPLE_RATE_HZ, u, y, SAMPLE_RATE_HZ, model.units)


def smallest_ess(chains: FloatArray) -> float:
    """Smallest bulk effective sample size of chains (ensembles, steps, walkers, parameters)."""
    return min(effective_sample_size(chains[..., i]) for i in range(chains.shape[-1]))


def operations(target: LogPosterior) -> int:
    """Vector instructions that one sample of one walker needs at least, in the kernel's own arithmetic.

    A multiply-add, an addition, a multiplication, a minimum and a maximum count one each, since each takes
    one slot of the units that a multiply-add takes: saturation 3, direct term 1, two a real pole, four a
    pair, dead zone and residual 6, one a lagged product.
    """
    poles = target.axis.model.linear.poles
    n_real, n_pairs = int(np.sum(poles.imag == 0)), int(np.sum(poles.imag > 0))
    return 4 + 2 * n_real + 4 * n_pairs + 6 + target.order + 1


def fma_seconds() -> float:
    """CPU seconds of one multiply-add of one lane at the core's peak: nine independent sums in registers."""
    values = np.full((11, LANES), 0.5)
    _fma_loop(values, 10)
    begin = time.process_time()
    _fma_loop(values, PEAK_LOOPS)
    return (time.process_time() - begin) / (9 * LANES * PEAK_LOOPS)


@njit(cache=True, nogil=True, error_model="numpy")
def _fma_loop(values, loops):  # type: ignore[no-untyped-def]
    x, y = load(values, 0), load(values, 1)
    a, b, c = load(values, 2), load(values, 3), load(values, 4)
    d, e, f = load(values, 5), load(values, 6), load(values, 7)
    g, h, i = load(values, 8), load(values, 9), load(values, 10)
    for _ in range(loops):
        a, b, c = x + a * y, x + b * y, x + c * y
        d, e, f = x + d * y, x + e * y, x + f * y
        g, h, i = x + g * y, x + h * y, x + i * y
    store(values, 2, a + b + c + d + e + f + g + h + i)


def shortest_seconds(call: Callable[[], object], repeats: int) -> float:
    """Smallest seconds of a few calls: what the others on the machine take away is not in it."""
    best = np.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - begin)
    return float(best)


def peak_memory_mb() -> float:
    """Largest memory that this process has held, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


FIRST_CALL = """
import time, numpy as np
from twin import twin_records
from bayes_hw.infer.inference import axis_for
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.identify.noise import NoiseEstimate
twin = twin_records(np.random.default_rng(1))
axis = axis_for(twin.truth, twin.train[:1], "conditional", "rest")
noise = noise_parameters(NoiseEstimate(0.003, np.array([0.6])), "deg")
target = LogPosterior(axis, noise, twin.train[:1])
values = np.array([parameter.nominal for parameter in target.parameters])
begin = time.perf_counter()
target(target.coordinates(np.repeat(values[None], 128, axis=0)))
print(time.perf_counter() - begin)
"""


def first_call_seconds() -> float:
    """Seconds of the first log-probability call of a fresh process that finds the compiled code on disk."""
    beside = Path(__file__).parent
    run = subprocess.run(
        [sys.executable, "-c", FIRST_CALL], capture_output=True, text=True, check=True, cwd=beside
    )
    return float(run.stdout)
