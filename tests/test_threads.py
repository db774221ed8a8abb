"""The linear-algebra library keeps to one thread where it is told to, and is given back afterwards."""

from __future__ import annotations

from threadpoolctl import threadpool_info

from bayes_hw.threads import one_blas_thread


def blas_threads() -> list[int]:
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]


def test_one_thread_inside_the_block() -> None:
    before = blas_threads()
    with one_blas_thread():
        assert blas_threads() and set(blas_threads()) == {1}
    assert blas_threads() == before
