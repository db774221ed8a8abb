"""A number of LANES walkers at once, as one value in compiled code.

`Lanes` is a numba type that LLVM keeps in vector registers: a sum or a product of two of them is a handful of
vector instructions, so that a kernel reads like the scalar equations and runs at the width of the machine.
Without it the compiler must first prove that arrays do not overlap, and mostly gives up vectorising.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable

from bayes_hw.compiled import compiled, compiled_inside

LANES = 16
"""Walkers in one value: two 512-bit or four 256-bit registers. A kernel that carries two poles at once then
has enough independent sums to hide latency and still keeps them all in registers."""

CACHE_LINE = 8
"""float64 numbers in a cache line: a vector that straddles two lines costs two accesses."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_CONTRACT = ("contract",)


class LanesType(types.Type):  # type: ignore[misc]
    """The numba type of LANES float64 numbers."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{LANES}")


LANES_TYPE = LanesType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, numba_type: LanesType) -> None:
        super().__init__(manager, numba_type, _VECTOR)


def _is_lanes(*arguments: Any) -> bool:
    return all(isinstance(argument, LanesType) for argument in arguments)


def _address(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    first = builder.gep(array.data, [builder.mul(arguments[1], ir.Constant(ir.IntType(64), LANES))])
    return builder.bitcast(first, _VECTOR.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(typing_context: Any, array: Any, row: Any) -> Any:
    """The LANES numbers of row `row` of a contiguous float64 array whose last axis has LANES entries."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_address(context, builder, signature, arguments), align=8)

    return LANES_TYPE(array, types.int64), generate


@intrinsic  # type: ignore[untyped-decorator]
def store(typing_context: Any, array: Any, row: Any, value: Any) -> Any:
    """Write `value` to row `row` of such an array."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _address(context, builder, signature, arguments), align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, LANES_TYPE), generate


@intrinsic  # type: ignore[untyped-decorator]
def broadcast(typing_context: Any, number: Any) -> Any:
    """The same number in every lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        single = builder.insert_element(
            ir.Constant(_VECTOR, ir.Undefined), arguments[0], ir.Constant(ir.IntType(32), 0)
        )
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return builder.shuffle_vector(single, ir.Constant(_VECTOR, ir.Undefined), zeros)

    return LANES_TYPE(types.float64), generate


def _arithmetic(operation: Any, instruction: str) -> None:
    """Give two values an operation by an LLVM floating-point instruction that may be contracted to FMA: as
    lowering of its own, since an overload would make a call and its tests of every sum."""

    @type_callable(operation)  # type: ignore[untyped-decorator]
    def typed(context: Any) -> Any:
        return lambda left, right: LANES_TYPE if _is_lanes(left, right) else None

    @lower_builtin(operation, LanesType, LanesType)  # type: ignore[untyped-decorator]
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(arguments[0], arguments[1], flags=_CONTRACT)


def _extremum(comparison: str) -> Any:
    """An intrinsic that takes, lane by lane, the right value where it compares so with the left one.

    A left value that is NaN is kept.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def operation(typing_context: Any, left: Any, right: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            right_wins = builder.fcmp_ordered(comparison, arguments[1], arguments[0])
            return builder.select(right_wins, arguments[1], arguments[0])

        return LANES_TYPE(LANES_TYPE, LANES_TYPE), generate

    return operation


_arithmetic(operator.add, "fadd")
_arithmetic(operator.sub, "fsub")
_arithmetic(operator.mul, "fmul")
_arithmetic(operator.truediv, "fdiv")
minimum = _extremum("<")
maximum = _extremum(">")


@compiled
def aligned_rows(rows):  # type: ignore[no-untyped-def]
    """An uninitialised array (rows, LANES) that begins with a cache line."""
    memory = np.empty(rows * LANES + CACHE_LINE)
    skipped = (-(memory.ctypes.data // 8)) % CACHE_LINE
    return memory[skipped : skipped + rows * LANES].reshape((rows, LANES))


@compiled_inside
def gather(values, group, rows):  # type: ignore[no-untyped-def]
    """Copy the lanes of one group from every row of a contiguous (..., walkers) into `rows` (rows, LANES)."""
    groups = values.shape[-1] // LANES
    for row in range(len(rows)):
        store(rows, row, load(values, row * groups + group))


@compiled_inside
def scatter(rows, group, values):  # type: ignore[no-untyped-def]
    """The opposite of `gather`."""
    groups = values.shape[-1] // LANES
    for row in range(len(rows)):
        store(values, row * groups + group, load(rows, row))


def padded_to_lanes(count: int) -> int:
    """`count` walkers rounded up to whole groups of LANES."""
    return -(-count // LANES) * LANES


def filled_up(values: np.ndarray) -> np.ndarray:
    """Array (..., walkers) made contiguous, the last walker repeated to fill whole groups of LANES."""
    missing = -values.shape[-1] % LANES
    if missing:
        values = np.concatenate([values, np.repeat(values[..., -1:], missing, axis=-1)], axis=-1)
    return np.ascontiguousarray(values)
