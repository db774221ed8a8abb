"""Coordinates in which poles may pass each other.

Exchanging two poles of a kind changes nothing but their names, so the posterior is that of poles in order.
Where a pole that the records hardly place may lie on either side of one that they place well, order bends it
into a corner: first the one moves up to the other, then, under the other's name, on. Here the poles keep the
names that they have at the estimate, whatever their order is: with p the density of ordered poles and s(x)
the point x put in order, the density of x is

    p(s(x)) w(x),    w(x) = e(x) / sum over all exchanges of names e(exchanged x),

e the density of a normal distribution about the estimate. The weights w of the exchanges of one ordered point
add up to one, so that points of this density, put in order, are points of p (Stephens, doi
10.1111/1467-9868.00265, chooses names after sampling; here they are drawn with it).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.compiled import compiled
from bayes_hw.model.axis_parameters import AxisParameters

SAME = 1e-9
"""Difference of a pole and what its coordinate under another name gives back: else it has none there."""


@dataclass(frozen=True, eq=False)
class PoleLabels:
    """The map from these coordinates to those of the parameters, for points (..., parameters).

    `pairs` holds a kind of pole pairs each, its rows (poles, numbers) with the frequencies first, then
    dampings; `values` are the rows of the free real poles, `weights` those of the nested weights of all real
    ones, `moving` are the free ones among these, and `places` (real poles,) where the model has all of them.
    `centre` and `width` (parameters,) are of e.
    """

    axis: AxisParameters
    centre: FloatArray
    width: FloatArray
    pairs: tuple[IntArray, ...]
    values: IntArray
    weights: IntArray
    moving: IntArray
    places: FloatArray

    @classmethod
    def of(cls, axis: AxisParameters, mode: FloatArray, covariance: FloatArray) -> PoleLabels | None:
        """For an axis and its estimate in coordinates (parameters or more,) with covariance; None where no
        two poles could be exchanged, and where the state of every pole at the start is free too."""
        names = axis.names
        kinds: dict[str, list[list[int]]] = {}
        for row, name in enumerate(names):
            if name.endswith(".frequency_hz"):
                pole = name.removesuffix("frequency_hz")
                own = [names.index(f"{pole}{what}") for what in ("damping_ratio", "cosine", "sine")
                       if f"{pole}{what}" in names]  # fmt: skip
                kinds.setdefault(pole.rstrip(".0123456789"), []).append([row, *own])
        pairs = tuple(np.array(rows) for rows in kinds.values() if len(rows) > 1)
        labels = [f"real_pole{i + 1}" for i in axis.free_real] if axis.free == "all" else []
        moving = [i for i, label in enumerate(labels) if f"{label}.value" in names]
        if axis.start_positions is not None or (not pairs and len(moving) < 2):
            return None
        places = axis.linear_batch(axis.nominal[:, None]).real_poles[axis.free_real, 0]
        return cls(
            axis,
            mode[: len(names)],
            np.sqrt(np.diag(covariance))[: len(names)],
            pairs,
            np.array([names.index(f"{labels[i]}.value") for i in moving], dtype=np.int64),
            np.array([names.index(f"{label}.weight") for label in labels], dtype=np.int64),
            np.array(moving, dtype=np.int64),
            places,
        )

    def to_plain(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the parameters with the poles in order, and what the log-density changes by, without
        the last axis; NaN where a pole has no place under the name that it has in order."""
        columns = points.reshape(-1, points.shape[-1]).T.copy()
        change = np.zeros(columns.shape[1])
        for rows in self.pairs:
            told = rows[:, :2]
            standard = (columns[told][None] - self.centre[told][:, None, :, None]) / self.width[told][
                :, None, :, None
            ]
            change += _log_share(-0.5 * np.sum(standard**2, axis=2))
            order = np.argsort(columns[rows[:, 0]], axis=0)
            columns[rows] = np.take_along_axis(columns[rows], order[:, None], axis=0)
        if len(self.values) > 1:
            change += self._real_poles_put_in_order(columns)
        return columns.T.reshape(points.shape), change.reshape(points.shape[:-1])

    def from_plain(self, plain: FloatArray) -> FloatArray:
        """Points in order are points of these coordinates."""
        return plain

    def _real_poles_put_in_order(self, columns: FloatArray) -> FloatArray:
        """Real poles of `columns` (parameters, points) put in order in place, and the change (points,) of the
        log-density."""
        transforms = [self.axis.parameters[row].transform for row in self.values]
        rows, count = self.values, len(self.values)
        own = columns[rows]
        with np.errstate(all="ignore"):
            poles = np.stack([t.to_value(c) for t, c in zip(transforms, own, strict=True)])
            named = np.empty((count, *poles.shape))
            for i, transform in enumerate(transforms):
                named[i] = transform.to_coordinate(poles)
                named[i, i] = own[i]
                named[i, np.abs(transform.to_value(named[i]) - poles) > SAME] = np.nan
            standard = (named - self.centre[rows, None, None]) / self.width[rows, None, None]
            change = _log_share(np.where(np.isnan(standard), -np.inf, -0.5 * standard**2))
            order = np.argsort(poles, axis=0)
            moved = np.flatnonzero(np.any(np.diff(order, axis=0) < 0, axis=0))
            if len(moved):
                everything = np.repeat(self.places[:, None], len(moved), axis=1)
                everything[self.moving] = poles[:, moved]
                wanted = np.repeat(np.arange(len(everything))[:, None], len(moved), axis=1)
                wanted[self.moving] = self.moving[order[:, moved]]
                weights = columns[np.ix_(self.weights, moved)]
                _exchange(everything, wanted, weights)
                columns[np.ix_(self.weights, moved)] = weights
                for i, transform in enumerate(transforms):
                    new = named[i, order[i, moved], moved]
                    columns[rows[i], moved] = new
                    change[moved] += transform.log_jacobian(own[i, moved]) - transform.log_jacobian(new)
        return change


def _log_share(score: FloatArray) -> FloatArray:
    """log (points,) of prod_i e_ii over the sum of prod_i e_i,s(i) for all permutations s, `score` log e of
    every pole under every name (names, poles, points): a sum over the sets of poles named so far."""
    count = len(score)
    sums = np.full((1 << count, score.shape[2]), -np.inf)
    sums[0] = 0.0
    for poles in range(1, 1 << count):
        name = poles.bit_count() - 1
        for pole in range(count):
            if poles >> pole & 1:
                sums[poles] = np.logaddexp(sums[poles], sums[poles ^ (1 << pole)] + score[name, pole])
    return np.asarray(np.einsum("iip->p", score) - sums[-1])


@compiled(nogil=True)
def _exchange(poles, wanted, weights):  # type: ignore[no-untyped-def]
    """Nested weights (poles, points) in place when the poles come in the order `wanted`: neighbours a, b of
    g / (z - a) + h / ((z - a) (z - b)) exchanged leave g and make h + (a - b) g of h."""
    count, points = poles.shape
    now = np.empty(count, dtype=np.int64)
    for k in range(points):
        for i in range(count):
            now[i] = i
        for i in range(count):
            place = i
            while now[place] != wanted[i, k]:
                place += 1
            for j in range(place - 1, i - 1, -1):
                first, second = now[j], now[j + 1]
                weights[j + 1, k] += (poles[first, k] - poles[second, k]) * weights[j, k]
                now[j], now[j + 1] = second, first
