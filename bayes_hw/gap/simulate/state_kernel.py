"""Compiled first-order states in lanes: stepped exactly for inputs held over a step, and read ahead.

With x' = F x + B v a step, an output c x is after j steps of one held v

    c F^j x + q_j v,    q_j = c (B + F B + ... + F^(j-1) B)

so that a state under a command held over a sample is stepped once a sample, and read within it by rows c F^j
made once (Astroem and Wittenmark, Computer-Controlled Systems, section 2.3).
"""

from __future__ import annotations

from bayes_hw.compiled import compiled_inside, pasted
from bayes_hw.model.lanes import broadcast, load, store


@pasted
def output_of(kind, rows, x):  # type: ignore[no-untyped-def]
    """One output of all states: x weighted by those of `rows` from row `kind` len(x) on."""
    first = kind * len(x)
    total = broadcast(0.0)
    for i in range(len(x)):
        total = total + load(rows, first + i) * load(x, i)
    return total


@compiled_inside
def response_to(kind, rows, door, inputs, n):  # type: ignore[no-untyped-def]
    """What a unit input at `door` adds to output `kind` of the `n` states in a step."""
    total = broadcast(0.0)
    for i in range(n):
        total = total + load(rows, kind * n + i) * load(inputs, door * n + i)
    return total


@pasted
def stepped(factors, inputs, door, force, real, x):  # type: ignore[no-untyped-def]
    """The states x a step later under `force` at `door`: `real` real ones, then pairs in two rows each."""
    first = door * len(x)
    for i in range(real):
        store(x, i, load(factors, i) * load(x, i) + load(inputs, first + i) * force)
    for i in range(real, len(x), 2):
        cosine, sinus = load(factors, i), load(factors, i + 1)
        one, other = load(x, i), load(x, i + 1)
        store(x, i, cosine * one - sinus * other + load(inputs, first + i) * force)
        store(x, i + 1, sinus * one + cosine * other + load(inputs, first + i + 1) * force)


@pasted
def pushed(inputs, door, force, x):  # type: ignore[no-untyped-def]
    """Add to the states x what `force`, held over a step, adds through the gains of `door`."""
    first = door * len(x)
    for i in range(len(x)):
        store(x, i, load(x, i) + load(inputs, first + i) * force)


@compiled_inside
def later_rows(rows, by_input, kind, steps, factors, inputs, real, n):  # type: ignore[no-untyped-def]
    """Fill the rows after `kind` with the same output 1 to `steps` steps later, and `by_input` (rows,) with
    what a unit input held so long adds to it."""
    store(by_input, kind, broadcast(0.0))
    for j in range(kind, kind + steps):
        store(by_input, j + 1, load(by_input, j) + response_to(j, rows, 0, inputs, n))
        at, after = j * n, (j + 1) * n
        for i in range(real):
            store(rows, after + i, load(rows, at + i) * load(factors, i))
        for i in range(real, n, 2):
            cosine, sinus = load(factors, i), load(factors, i + 1)
            one, other = load(rows, at + i), load(rows, at + i + 1)
            store(rows, after + i, one * cosine + other * sinus)
            store(rows, after + i + 1, other * cosine - one * sinus)


@compiled_inside
def repeated(factors, inputs, steps, real, all_factors, all_inputs):  # type: ignore[no-untyped-def]
    """Fill `all_factors` and `all_inputs` with those of `steps` steps under one held input."""
    all_inputs[:] = 0.0
    all_factors[:] = 0.0
    for i in range(len(all_factors)):
        if i < real or (i - real) % 2 == 0:
            store(all_factors, i, broadcast(1.0))
    for _ in range(steps):
        stepped(factors, inputs, 0, broadcast(1.0), real, all_inputs)
        for i in range(real):
            store(all_factors, i, load(all_factors, i) * load(factors, i))
        for i in range(real, len(all_factors), 2):
            cosine, sinus = load(factors, i), load(factors, i + 1)
            one, other = load(all_factors, i), load(all_factors, i + 1)
            store(all_factors, i, cosine * one - sinus * other)
            store(all_factors, i + 1, sinus * one + cosine * other)
