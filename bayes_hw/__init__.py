"""Bayesian Hammerstein-Wiener models of telescope servo axes.

    import bayes_hw as hw

    records = [hw.Record.read("train_1.csv"), hw.Record.read("train_2.csv")]
    hw.look(records).write("look/")
    model = hw.identify(records).model
    posterior = hw.sample(model, records)
    gap = hw.diagnose(model, records, [hw.Record.read("holdout.csv")])

Each answer has `.to_dataframe()` and `.plot()`; `posterior.tree` is an ArviZ tree. What stands here is
imported when it is first used, so that `import bayes_hw` is light.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bayes_hw.errors import InputError as InputError
    from bayes_hw.interface.gap_diagnosis import diagnose as diagnose
    from bayes_hw.interface.identified_axis import identify as identify
    from bayes_hw.interface.sampled_posterior import sample as sample
    from bayes_hw.interface.seen_records import look as look
    from bayes_hw.model.hammerstein_wiener import HammersteinWiener as HammersteinWiener
    from bayes_hw.record import Columns as Columns
    from bayes_hw.record import Record as Record
    from bayes_hw.record import Units as Units

__version__ = "0.2.0"

_HOMES = {
    "Columns": "bayes_hw.record",
    "HammersteinWiener": "bayes_hw.model.hammerstein_wiener",
    "InputError": "bayes_hw.errors",
    "Record": "bayes_hw.record",
    "Units": "bayes_hw.record",
    "diagnose": "bayes_hw.interface.gap_diagnosis",
    "look": "bayes_hw.interface.seen_records",
    "sample": "bayes_hw.interface.sampled_posterior",
}
"""Where each name of the Python interface lives."""

__all__ = [*_HOMES, "__version__", "identify"]


def __getattr__(name: str) -> Any:
    if name == "identify":
        return importlib.import_module("bayes_hw.identify")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
