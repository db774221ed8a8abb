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
from numba.extending import intrinsic, models, overload, register_model

LANES = 32
"""Walkers in one value: four 512-bit or eight 256-bit registers, enough independent sums to hide latency."""

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


def _binary(instruction: str) -> Any:
    """An intrinsic of two values by an LLVM floating-point instruction that may be contracted to FMA."""

    @intrinsic  # type: ignore[untyped-decorator]
    def operation(typing_context: Any, left: Any, right: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, instruction)(arguments[0], arguments[1], flags=_CONTRACT)

        return LANES_TYPE(LANES_TYPE, LANES_TYPE), generate

    return operation


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


_add, _subtract, _multiply = _binary("fadd"), _binary("fsub"), _binary("fmul")
minimum = _extremum("<")
maximum = _extremum(">")


@overload(operator.add)
def _add_lanes(left, right):  # type: ignore[no-untyped-def]
    return (lambda left, right: _add(left, right)) if _is_lanes(left, right) else None


@overload(operator.sub)
def _subtract_lanes(left, right):  # type: ignore[no-untyped-def]
    return (lambda left, right: _subtract(left, right)) if _is_lanes(left, right) else None


@overload(operator.mul)
def _multiply_lanes(left, right):  # type: ignore[no-untyped-def]
    return (lambda left, right: _multiply(left, right)) if _is_lanes(left, right) else None


def padded_to_lanes(count: int) -> int:
    """`count` walkers rounded up to whole groups of LANES."""
    return -(-count // LANES) * LANES


def in_lane_groups(values: np.ndarray) -> np.ndarray:
    """Array (..., walkers) as a contiguous (groups, ..., LANES), the last walker repeated to fill."""
    groups = padded_to_lanes(values.shape[-1]) // LANES
    fill = groups * LANES - values.shape[-1]
    widths = [(0, 0)] * (values.ndim - 1) + [(0, fill)]
    padded = np.pad(values, widths, mode="edge")
    grouped = padded.reshape(*values.shape[:-1], groups, LANES)
    return np.ascontiguousarray(np.moveaxis(grouped, -2, 0))
