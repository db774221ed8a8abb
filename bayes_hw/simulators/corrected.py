"""What a corrected simulator holds, whatever its kind, and the text of the program that runs it.

The program needs nothing of bayes_hw: it carries the text of what simulates here.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import write_json
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.simulate import signal_kernel
from bayes_hw.simulators import corrected_run
from bayes_hw.simulators.around import NEUTRAL, NUMBER
from bayes_hw.simulators.simulator_file import SimulatorFile

SCHEMA = "bayes-hw/corrected-simulator/1"
DRAWS = 20
NUMBERS = "corrected.json"
PROGRAM = "simulate.py"


@dataclass(frozen=True)
class Corrected:
    """Number 0 the posterior mean, others draws: parameters by name, values (base parameters,) of the base
    parameters, settings (COUNT,)."""

    number: int
    parameters: dict[str, float]
    base: FloatArray
    settings: FloatArray


def corrected_ones(diagnosis: Diagnosis, rng: np.random.Generator) -> list[Corrected]:
    """The posterior mean, in the coordinates of the parameters, and DRAWS draws."""
    hypothesis = diagnosis.final.fit.hypothesis
    picked = rng.choice(len(diagnosis.draws), DRAWS, replace=len(diagnosis.draws) < DRAWS)
    points = np.vstack([diagnosis.draws.mean(axis=0), diagnosis.draws[picked]])
    found = []
    for number, values in enumerate(hypothesis.to_values(points)):
        named = dict(zip((p.name for p in hypothesis.parameters), values.tolist(), strict=True))
        settings = hypothesis.settings(values, hypothesis.chain(values))
        found.append(Corrected(number, named, values[: hypothesis.base_count], settings))
    return found


def write_numbers(
    folder: Path,
    axis: SimulatorFile,
    diagnosis: Diagnosis,
    items: Sequence[dict[str, object]],
    loop: dict[str, object],
    outputs: Sequence[Sequence[FloatArray]] = (),
) -> None:
    """Write corrected.json: `items` of the mean and the draws, `loop` what they share, and how far their
    `outputs` (samples,), a record held out each, close the gap beside what the verdict said."""
    verdict, acting = diagnosis.verdict, diagnosis.final.fit.hypothesis.labels
    numbers: dict[str, object] = {
        "schema": SCHEMA,
        "answer": list(verdict.answer),
        "not_in_it": [label for label in verdict.answer if label not in acting],
        "sample_rate_hz": axis.sample_rate_hz,
        "units": axis.units.to_dict(),
        "loop": loop,
        "mean": items[0],
        "draws": list(items[1:]),
    }
    if outputs:
        closed = [closure(diagnosis, output) for output in outputs]
        said = verdict.gap_holdout.to_dict()
        numbers["holdout"] = {"closed": closed[0], "closed_draws": closed[1:], "said": said}
    write_json(folder / NUMBERS, numbers)


def closure(diagnosis: Diagnosis, outputs: Sequence[FloatArray]) -> float:
    """The share of the reducible error on the records held out that `outputs` remove.

    That of the verdict, less what their squared error is above that of its prediction, as a share of the
    reducible error that the verdict's own two errors and its closure make.
    """
    said = diagnosis.verdict.gap_holdout
    errors = np.concatenate([r.y - y for r, y in zip(diagnosis.case.holdout, outputs, strict=True)])
    removed = said.rmse_before**2 - said.rmse_after**2
    if not (removed > 0 and said.closed > 0):
        return 0.0
    return said.closed * (1 - (float(np.mean(errors**2)) - said.rmse_after**2) / removed)


def program(head: ModuleType, parts: Sequence[ModuleType]) -> str:
    """The text of a program: `head` with what it imports of bayes_hw, `parts` in their order, before it; what
    all such programs share comes first."""
    text = inspect.getsource(head)
    start = text.index("from __future__")
    kernels = [_kernel(name) for name in ("behind_dead_zone", "command_side", "output_side")]
    constants = [f"{name} = {i}" for name, i in NUMBER.items()]
    neutral = ", ".join(f'float("{x!r}")' if np.isinf(x) else repr(x) for x in NEUTRAL.tolist())
    table = [f"NEUTRAL = np.array([{neutral}])", f"NUMBER = {NUMBER!r}"]
    own = [_body(module) for module in (corrected_run, *parts)]
    settings = "\n".join(["TAU = 2 * np.pi", *constants, *table])
    body = _body(head)
    return "\n\n\n".join(
        [text[:start] + "from __future__ import annotations", *own, settings, *kernels, body, ""]
    )


def _body(module: ModuleType) -> str:
    """A module's text without its docstring and without what it imports of bayes_hw."""
    text = inspect.getsource(module)
    lines = text[text.index("from __future__") :].splitlines()[1:]
    return "\n".join(line for line in lines if not line.startswith("from bayes_hw")).strip()


def _kernel(name: str) -> str:
    """A compiled kernel's text, its settings under their bare names."""
    text = inspect.getsource(getattr(signal_kernel, name).py_func)
    return re.sub(r"@compiled.*", "@compiled", re.sub(r"\bS\.([A-Z_]+)", r"\1", text)).strip()
