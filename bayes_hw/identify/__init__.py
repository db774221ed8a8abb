"""identify(records, *, seed=1, name=None, start="auto", origin="start", accept=()) -> IdentifiedAxis

The four-step estimate of a Hammerstein-Wiener model from one Record or several of one axis; as `bayes-hw
identify`. `sample` and `diagnose` take it, or its `.model`. `name` is the model's; `start` is "rest", "free"
(the initial state of every record is estimated) or "auto"; angles count from where each record begins unless
`origin` is "absolute"; `accept` names faults of the records to take them in spite of. Raises InputError where
the records cannot be used. See `bayes_hw.interface.identified_axis.identify`.

In the package are subspace identification, the four steps and the linear baseline.

This room shares its name with the function of the Python interface. `bayes_hw.identify` is therefore the
package, whichever was asked for first, and calling it is calling that function.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bayes_hw.interface.identified_axis import IdentifiedAxis
    from bayes_hw.posing import Origin, Start
    from bayes_hw.record import Record


class _CallableRoom(ModuleType):
    """A package that answers a call as `bayes_hw.interface.identified_axis.identify` does."""

    def __call__(
        self,
        records: Record | Sequence[Record],
        *,
        seed: int = 1,
        name: str | None = None,
        start: Start = "auto",
        origin: Origin = "start",
        accept: Collection[str] = (),
    ) -> IdentifiedAxis:
        from bayes_hw.interface.identified_axis import identify

        return identify(records, seed=seed, name=name, start=start, origin=origin, accept=accept)


sys.modules[__name__].__class__ = _CallableRoom
