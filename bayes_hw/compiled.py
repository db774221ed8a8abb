"""How numerical code is compiled: kept on the disk, divided as numpy divides, and no more than is called.

numba wraps what it compiles for callers from Python and from C, often at more expense than the code itself:
nothing here is called from C, and half of it not from Python.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from numba import njit

compiled: Any = partial(njit, cache=True, error_model="numpy", no_cfunc_wrapper=True)
"""For functions that Python calls."""

compiled_inside: Any = partial(compiled, no_cpython_wrapper=True)
"""For functions that compiled ones alone call."""

compiled_loop: Any = partial(compiled_inside, _nrt=False)
"""For loops over arrays that their caller holds: nothing is allocated, and nobody counts who holds what,
which in a loop of a few nanoseconds a turn costs more than its arithmetic."""

pasted: Any = partial(compiled, inline="always")
"""For small ones that numba writes into their callers; there they are read and typed anew at every place."""
