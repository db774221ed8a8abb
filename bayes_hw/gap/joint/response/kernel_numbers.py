"""What the kernel of a cascade with effects is given, in groups of arrays with names."""

from __future__ import annotations

from typing import NamedTuple

from bayes_hw.arrays import FloatArray, IntArray


class Paths(NamedTuple):
    """G and the ports of n real poles, m sections and every law.

    `residue` is the integrator's; `real` (2, n): poles and residues; `sections` (4, m): a1, a2, b1, b2; for
    every law `port_real` (laws, n), `port_sections` (laws, 2, m), `direct` (laws, 2): weight and pole,
    `signal_real` (laws, n) and `signal_sections` (laws, 2, m).
    """

    residue: float
    real: FloatArray
    sections: FloatArray
    port_real: FloatArray
    port_sections: FloatArray
    direct: FloatArray
    signal_real: FloatArray
    signal_sections: FloatArray


class Laws(NamedTuple):
    """Every torque's `law` and `base` (laws,) as `effect_codes` numbers them, its parameters `theta`
    (laws, 3), and of a KNOWN law the torque `forced` and its derivative by the lag `by_lag` (laws, samples).

    An INNOVATION is a torque of what was measured, `forced`, less y, times `by_lag`: zero in the dead zone,
    where y tells nothing of w, and growing over the edge beyond it.
    """

    law: IntArray
    base: IntArray
    theta: FloatArray
    forced: FloatArray
    by_lag: FloatArray


class Axis(NamedTuple):
    """`static` (4,): limits, half width, edge; `inputs` (13,) and `outputs` (10,) as `effect_codes` numbers
    them, rates as samples per unit, times in samples; `paths` of a step; `laws`."""

    static: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    paths: Paths
    laws: Laws


class PathColumns(NamedTuple):
    """The column of tangents of every number of `Paths`, -1 where there is none."""

    residue: int
    real: IntArray
    sections: IntArray
    port_real: IntArray
    port_sections: IntArray
    direct: IntArray
    signal_real: IntArray
    signal_sections: IntArray


class Columns(NamedTuple):
    """The same for all of an `Axis`; `size` columns, of which `read` (k,) begin with what known inputs add
    to the readings."""

    size: int
    static: IntArray
    inputs: IntArray
    outputs: IntArray
    theta: IntArray
    read: IntArray
    paths: PathColumns


class Simulated(NamedTuple):
    """What one record's simulation gives, each of shape (samples,); `slope` is dy/dw. `torques` and `signals`
    (laws, samples) are what the laws of its torques give and look at."""

    v: FloatArray
    w: FloatArray
    y: FloatArray
    slope: FloatArray
    torques: FloatArray
    signals: FloatArray
