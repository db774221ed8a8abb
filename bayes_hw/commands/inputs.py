"""Records and settings from the options, checked."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from bayes_hw.errors import InputError, storable_text
from bayes_hw.record import Columns, Record, Units

if TYPE_CHECKING:
    from bayes_hw.infer.sampler import SamplerSettings


def read_records(
    parsed: argparse.Namespace, paths: Sequence[str], units: Units | None = None
) -> list[Record]:
    """The records at `paths` as the options say; `units` are the model's, where there is one.

    Raises InputError when an option gives another unit than the model has, or a record states another than
    options, model or the first record.
    """
    for option, given, of_model in (
        ("--input-unit", parsed.input_unit, units and units.input),
        ("--output-unit", parsed.output_unit, units and units.output),
    ):
        if given is not None and of_model is not None and given != of_model:
            raise InputError(
                f"{option} {given}: the model is in {of_model}; give records in the model's unit"
            )
        storable_text(given or "", option)
    options = {"input": parsed.input_unit, "output": parsed.output_unit}
    chosen: Units | dict[str, str] = units or {role: unit for role, unit in options.items() if unit}
    columns = Columns(
        time=None if parsed.time == "none" else parsed.time, input=parsed.input, output=parsed.output
    )
    records: list[Record] = []
    for path in paths:
        record = Record.read(
            path,
            columns=columns,
            sample_rate_hz=parsed.sample_rate,
            resample_hz=parsed.resample,
            units=chosen,
        )
        records.append(record)
        chosen = records[0].units
    return records


def sampler_settings(parsed: argparse.Namespace) -> SamplerSettings:
    """The sampler's settings from the options, checked."""
    from bayes_hw.infer.sampler import SamplerSettings

    if parsed.ensembles < 4:
        raise InputError(f"--ensembles {parsed.ensembles}: convergence needs four or more")
    if parsed.walkers is not None and (parsed.walkers < 16 or parsed.walkers % 2):
        raise InputError(f"--walkers {parsed.walkers}: must be even, 16 or more")
    if parsed.max_steps < 50:
        raise InputError(f"--max-steps {parsed.max_steps}: must be 50 or more")
    if not parsed.target_ess > 0:
        raise InputError(f"--target-ess {parsed.target_ess:g}: must be positive")
    return SamplerSettings(
        ensembles=parsed.ensembles,
        walkers=parsed.walkers,
        max_steps=parsed.max_steps,
        target_ess=parsed.target_ess,
    )
