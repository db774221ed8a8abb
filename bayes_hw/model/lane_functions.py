"""Choice, root and transcendental functions of `bayes_hw.model.lanes` values, lane by lane, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

from bayes_hw.compiled import compiled_inside, pasted
from bayes_hw.model.lanes import LANES, LANES_TYPE, broadcast, maximum, minimum

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INTEGERS = ir.VectorType(ir.IntType(64), LANES)

TO_INTEGER = 1.5 * 2.0**52
"""Added and taken away again it rounds a number below 2^51 to an integer."""

QUARTER_TURN = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
"""pi / 2 as a sum: 33 bits, 33 bits and the rest, so that small multiples of the first two are exact."""

LOG_TWO = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
"""log(2) as a sum, the first part of 33 bits."""

SINE = tuple(float((-1) ** i / np.prod(np.arange(1.0, 2 * i + 2))) for i in range(1, 9))
COSINE = tuple(float((-1) ** i / np.prod(np.arange(1.0, 2 * i + 1))) for i in range(1, 10))
EXPONENTIAL = tuple(float(1 / np.prod(np.arange(1.0, i + 1))) for i in range(14))
"""Taylor coefficients, in ascending order; enough of them for double precision on the reduced argument."""

LOGARITHM = tuple(2 / (2 * i + 1) for i in range(11))
"""Of 2 artanh(s) / s in powers of s^2, |s| < 0.172."""

ARCTANGENT = tuple((-1) ** i / (2 * i + 1) for i in range(23))
"""Of arctan(t) / t in powers of t^2, |t| < 0.415."""

EIGHTH_OF_A_TURN = np.sqrt(2.0) - 1
"""Tangent of half of an eighth of a turn: beyond it an eighth is taken off."""

SMALLEST_EXPONENT, LARGEST_EXPONENT = -708.0, 709.0


@intrinsic  # type: ignore[untyped-decorator]
def where_less(typing_context: Any, left: Any, right: Any, then: Any, otherwise: Any) -> Any:
    """`then` where `left` < `right`, else `otherwise`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        less = builder.fcmp_ordered("<", arguments[0], arguments[1])
        return builder.select(less, arguments[2], arguments[3])

    return LANES_TYPE(LANES_TYPE, LANES_TYPE, LANES_TYPE, LANES_TYPE), generate


@intrinsic  # type: ignore[untyped-decorator]
def _low_bits_as_exponent(typing_context: Any, value: Any) -> Any:
    """The number whose exponent bits are the lowest bits of `value`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        shift = ir.Constant(_INTEGERS, [52] * LANES)
        return builder.bitcast(builder.shl(builder.bitcast(arguments[0], _INTEGERS), shift), _VECTOR)

    return LANES_TYPE(LANES_TYPE), generate


@intrinsic  # type: ignore[untyped-decorator]
def _exponent_and_two_to_52(typing_context: Any, value: Any) -> Any:
    """2^52 plus the exponent bits of a positive `value` as an integer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.lshr(builder.bitcast(arguments[0], _INTEGERS), ir.Constant(_INTEGERS, [52] * LANES))
        return builder.bitcast(builder.or_(bits, ir.Constant(_INTEGERS, [0x433 << 52] * LANES)), _VECTOR)

    return LANES_TYPE(LANES_TYPE), generate


@intrinsic  # type: ignore[untyped-decorator]
def _between_one_and_two(typing_context: Any, value: Any) -> Any:
    """A positive `value` with the exponent of one."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], _INTEGERS)
        fraction = builder.and_(bits, ir.Constant(_INTEGERS, [(1 << 52) - 1] * LANES))
        return builder.bitcast(builder.or_(fraction, ir.Constant(_INTEGERS, [0x3FF << 52] * LANES)), _VECTOR)

    return LANES_TYPE(LANES_TYPE), generate


@pasted
def absolute(x):  # type: ignore[no-untyped-def]
    return maximum(x, broadcast(0.0) - x)


@pasted
def _rounded(x):  # type: ignore[no-untyped-def]
    return (x + broadcast(TO_INTEGER)) - broadcast(TO_INTEGER)


@intrinsic  # type: ignore[untyped-decorator]
def square_root(typing_context: Any, value: Any) -> Any:
    """sqrt(value), NaN where it is negative."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        of_vector = ir.FunctionType(_VECTOR, [_VECTOR])
        root = get_or_insert_function(builder.module, of_vector, f"llvm.sqrt.v{LANES}f64")
        return builder.call(root, [arguments[0]])

    return LANES_TYPE(LANES_TYPE), generate


@compiled_inside
def sine(x):  # type: ignore[no-untyped-def]
    """sin(x), to 1e-15 for |x| < 1e6."""
    return _sine_after(x, 0.0)


@compiled_inside
def cosine(x):  # type: ignore[no-untyped-def]
    """cos(x), to 1e-15 for |x| < 1e6."""
    return _sine_after(x, 1.0)


@pasted
def _sine_after(x, ahead):  # type: ignore[no-untyped-def]
    """sin(x + `ahead` quarter turns): reduced by quarter turns (Cody and Waite), then Taylor's polynomial."""
    quarters = _rounded(x * broadcast(2 / np.pi))
    r = x - quarters * broadcast(QUARTER_TURN[0])
    r = r - quarters * broadcast(QUARTER_TURN[1])
    r = r - quarters * broadcast(QUARTER_TURN[2])
    r = minimum(maximum(r, broadcast(-1.0)), broadcast(1.0))
    square = r * r
    by_sine, by_cosine = broadcast(SINE[7]), broadcast(COSINE[8])
    for i in range(7):
        by_sine = by_sine * square + broadcast(SINE[6 - i])
    for i in range(8):
        by_cosine = by_cosine * square + broadcast(COSINE[7 - i])
    by_sine = r + r * square * by_sine
    by_cosine = broadcast(1.0) + square * by_cosine
    quarters = quarters + broadcast(ahead)
    turns = _rounded((quarters - broadcast(1.5)) * broadcast(0.25))
    quadrant = quarters - broadcast(4.0) * turns
    odd = quadrant - broadcast(2.0) * _rounded((quadrant - broadcast(0.5)) * broadcast(0.5))
    size = where_less(odd, broadcast(0.5), by_sine, by_cosine)
    return where_less(quadrant, broadcast(1.5), size, broadcast(0.0) - size)


@pasted
def _cubic(first, r, square):  # type: ignore[no-untyped-def]
    """Four terms of the exponential's series from `first` on, over r^first, in parallel (Estrin)."""
    low = broadcast(EXPONENTIAL[first]) + broadcast(EXPONENTIAL[first + 1]) * r
    high = broadcast(EXPONENTIAL[first + 2]) + broadcast(EXPONENTIAL[first + 3]) * r
    return low + square * high


@compiled_inside
def exponential(x):  # type: ignore[no-untyped-def]
    """exp(x) to 1e-15, from the smallest to the largest normal number."""
    x = minimum(maximum(x, broadcast(SMALLEST_EXPONENT)), broadcast(LARGEST_EXPONENT))
    doublings = _rounded(x * broadcast(1 / np.log(2.0)))
    r = x - doublings * broadcast(LOG_TWO[0])
    r = r - doublings * broadcast(LOG_TWO[1])
    square = r * r
    fourth = square * square
    eighth = fourth * fourth
    low = _cubic(0, r, square) + fourth * _cubic(4, r, square)
    high = _cubic(8, r, square) + fourth * (broadcast(EXPONENTIAL[12]) + broadcast(EXPONENTIAL[13]) * r)
    total = low + eighth * high
    return total * _low_bits_as_exponent(doublings + broadcast(2.0**52 + 1023))


@compiled_inside
def logarithm(x):  # type: ignore[no-untyped-def]
    """log(x) to 1e-15 for positive normal numbers, not a number for others that are not zero."""
    doublings = _exponent_and_two_to_52(x) - broadcast(2.0**52 + 1023)
    m = _between_one_and_two(x)
    above = broadcast(np.sqrt(2.0))
    doublings = where_less(above, m, doublings + broadcast(1.0), doublings)
    m = where_less(above, m, broadcast(0.5) * m, m)
    s = (m - broadcast(1.0)) / (m + broadcast(1.0))
    square, series = s * s, broadcast(LOGARITHM[10])
    for i in range(10):
        series = series * square + broadcast(LOGARITHM[9 - i])
    found = doublings * broadcast(LOG_TWO[0]) + (s * series + doublings * broadcast(LOG_TWO[1]))
    return where_less(x, broadcast(np.inf), found, x)


@compiled_inside
def angle_of(x, y):  # type: ignore[no-untyped-def]
    """arctan2(y, x) to 1e-15: by symmetry from arctan between nothing and an eighth of a turn."""
    along, across = absolute(x), absolute(y)
    t = minimum(along, across) / maximum(along, across)
    far = broadcast(EIGHTH_OF_A_TURN)
    reduced = where_less(far, t, (t - broadcast(1.0)) / (t + broadcast(1.0)), t)
    square, series = reduced * reduced, broadcast(ARCTANGENT[22])
    for i in range(22):
        series = series * square + broadcast(ARCTANGENT[21 - i])
    angle = reduced * series + where_less(far, t, broadcast(np.pi / 4), broadcast(0.0))
    angle = where_less(along, across, broadcast(np.pi / 2) - angle, angle)
    angle = where_less(x, broadcast(0.0), broadcast(np.pi) - angle, angle)
    return where_less(y, broadcast(0.0), broadcast(0.0) - angle, angle)
