"""The records that a posterior was sampled with, as its file keeps them."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.infer.posterior import Posterior
from bayes_hw.record import Record


def stored_records(folder: Path | str, posterior: Posterior) -> tuple[Record, ...]:
    """The records in `folder`/posterior.nc, which `posterior` was read from; none where it holds none.

    Their time stamps are counted from zero. Raises InputError when the file is damaged.
    """
    path = Path(folder) / "posterior.nc"
    model = posterior.axis.model
    found: list[Record] = []
    try:
        with h5py.File(path, "r") as file:
            if "observed_data" not in file:
                return ()
            outputs, commands = file["observed_data"], file["constant_data"]
            while f"y{len(found) + 1}" in outputs:
                number = len(found) + 1
                u, y = np.asarray(commands[f"u{number}"]), np.asarray(outputs[f"y{number}"])
                t = np.arange(len(u)) / model.sample_rate_hz
                name = f"record {number}"
                found.append(Record(name, t, u, y, model.sample_rate_hz, model.units, source=str(path)))
    except (OSError, KeyError, ValueError):
        raise InputError(f"{path}: damaged or not written by bayes-hw; sample again") from None
    return tuple(found)
