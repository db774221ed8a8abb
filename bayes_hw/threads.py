"""Keeping the linear-algebra library from starting threads of its own."""

from __future__ import annotations

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def one_blas_thread() -> AbstractContextManager[object]:
    """One BLAS thread inside the block.

    The matrices here are small and the ensembles already fill the cores: the library's own threads would only
    wait for each other, which has cost a factor of ten.
    """
    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
