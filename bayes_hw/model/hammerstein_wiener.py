"""The cascade y = n(G(z) f(u)) and its file, model.json."""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.errors import InputError, storable_text
from bayes_hw.files import GIVE_A_MODEL, read_json, temporary_sibling, write_json
from bayes_hw.model.blocks import DeadZone, GainNormalization, Saturation
from bayes_hw.model.idnlhw import read_idnlhw, write_idnlhw
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.known_input import TORQUE, KnownInput
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.model.modal import linear_batch, modal_form
from bayes_hw.model.physical import Physical
from bayes_hw.record import Units

WELL_APART = 1e-3
"""Poles at least this far apart (in z) have residues small enough for the modal form."""

MODE_MATCH_RADIUS = 0.05
"""A dominant mode must lie this close (in z) to one of the pole pairs of G."""

KEPT_SAMPLES, KEPT_TO = 500, 1e-4
"""Samples of each of three steps, and the share of the travel to which polynomials must hold a model."""

LARGEST_VALUE = 1e12
"""A number in model.json beyond this is a mistake, and overflows when squared and summed."""

MOST_ROOTS = 200
"""Poles or zeros, or coefficients of either polynomial, that a model.json may hold."""

LONGEST_DELAY = 1_000_000
"""Samples of delay that a model.json may ask for."""


class Simulation(NamedTuple):
    """The signals of one noise-free simulation, each of shape (samples,)."""

    v: FloatArray
    w: FloatArray
    y: FloatArray


@dataclass(frozen=True, eq=False)
class HammersteinWiener:
    """A servo axis: saturation, linear block, dead zone, and the noise on its encoder.

    `dominant_modes` are pole pairs of `linear` whose frequency and damping count as parameters;
    `noise_sigma` is the marginal standard deviation in output units, NaN where it is not known; `known` are
    further inputs; `physical` is what the owner knows of the mechanics behind G.
    """

    name: str
    sample_rate_hz: float
    saturation: Saturation
    linear: LinearBlock
    dead_zone: DeadZone
    dominant_modes: tuple[Mode, ...] = ()
    noise_sigma: float = float("nan")
    units: Units = field(default_factory=Units)
    known: tuple[KnownInput, ...] = ()
    physical: Physical | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise InputError("sample_rate_hz: must be finite and positive")
        ordered = tuple(sorted(self.dominant_modes, key=lambda mode: mode.frequency_hz))
        object.__setattr__(self, "dominant_modes", ordered)

    @property
    def normalization(self) -> GainNormalization:
        """The gains c1, c2, c3 as one object."""
        return GainNormalization(
            self.saturation.gain, self.dead_zone.gain_positive, self.dead_zone.gain_negative
        )

    def normalized(self, normalization: GainNormalization) -> HammersteinWiener:
        """The same axis with other gains c1, c2, c3 in its blocks (nothing else is rescaled)."""
        return replace(
            self,
            saturation=replace(self.saturation, gain=normalization.c1),
            dead_zone=replace(self.dead_zone, gain_positive=normalization.c2, gain_negative=normalization.c3),
        )

    def mode_indices(self) -> list[int]:
        """For each dominant mode, the index of its pole with positive imaginary part.

        Raises InputError when a mode has no pole pair of its own nearby.
        """
        candidates = [i for i, pole in enumerate(self.linear.poles) if pole.imag > 0]
        chosen: list[int] = []
        for number, mode in enumerate(self.dominant_modes, start=1):
            target = mode.pole(self.sample_rate_hz)
            free = [i for i in candidates if i not in chosen]
            nearest = min(free, key=lambda i: abs(self.linear.poles[i] - target), default=None)
            if nearest is None or abs(self.linear.poles[nearest] - target) > MODE_MATCH_RADIUS:
                raise InputError(
                    f"dominant_modes[{number - 1}]: no pole pair of linear.poles lies near "
                    f"{mode.frequency_hz:g} Hz with damping {mode.damping_ratio:g}; "
                    "list only modes that are poles of G"
                )
            chosen.append(nearest)
        return chosen

    def simulate(
        self,
        u: FloatArray,
        initial_position: float = 0.0,
        known: Mapping[str, FloatArray] | None = None,
    ) -> Simulation:
        """Noise-free response to the command u from rest at w = initial_position (eq. 4), and to the columns
        (samples,) of the model's known inputs where `known` holds them by name; without it they rest.

        In modal form where the poles are well apart, which is accurate to a few units in the last place, and
        by a cascade of second-order sections otherwise.
        """
        v = self.saturation(u)
        w = self.linear.filter(v) if self.linear.smallest_separation < WELL_APART else self._modal_w(v)
        w = w + initial_position
        if not self.known or known is None:
            return Simulation(v, w, self.dead_zone(w))
        reading = np.zeros(len(w))
        for one in self.known:
            added = one.added(known, len(w))
            if one.way == TORQUE:
                w = w + added
            else:
                reading += added
        return Simulation(v, w, self.dead_zone(w) + reading)

    def _modal_w(self, v: FloatArray) -> FloatArray:
        unlimited = np.array([[-np.inf], [np.inf], [1.0], [0.0], [1.0], [1.0]])
        form = modal_form(linear_batch(self.linear, 1), unlimited)
        return simulate_batch(form, v, self.linear.delay_samples).w[0]

    @classmethod
    def read(cls, path: Path | str) -> HammersteinWiener:
        """Read model.json, or an idnlhw structure where the path ends in .mat; checks that it is stable.

        Raises InputError that names the file, the key and the remedy.
        """
        path = Path(path)
        try:
            data: Any = read_idnlhw(path) if path.suffix.lower() == ".mat" else read_json(path, GIVE_A_MODEL)
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror}); {GIVE_A_MODEL}") from None
        try:
            model = cls.from_dict(data)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        return model

    @classmethod
    def from_dict(cls, data: Any) -> HammersteinWiener:
        """Build the model from the content of model.json; raises InputError naming the key."""
        if not isinstance(data, Mapping):
            raise InputError("the top level must be an object with the keys of model.json")
        rate = _number(data, "sample_rate_hz")
        if rate <= 0:
            raise InputError("sample_rate_hz: must be finite and positive")
        linear = _linear_block(_mapping(data, "linear"))
        saturation = _mapping(data, "saturation")
        normalization = _normalization(_mapping(data, "normalization", optional=True))
        modes = data.get("dominant_modes")
        dominant = (
            tuple(linear.modes(rate))
            if modes is None
            else tuple(_mode(item, index, rate) for index, item in enumerate(_list(modes, "dominant_modes")))
        )
        noise = _mapping(data, "noise", optional=True)
        sigma = _number(noise, "noise.sigma") if "sigma" in noise else float("nan")
        if sigma < 0:
            raise InputError("noise.sigma: must be zero or more")
        model = cls(
            name=storable_text(str(data.get("name", "axis")), "name"),
            sample_rate_hz=rate,
            saturation=Saturation(
                _number(saturation, "saturation.lower"),
                _number(saturation, "saturation.upper"),
                normalization.c1,
            ),
            linear=linear,
            dead_zone=DeadZone(
                _number(_mapping(data, "dead_zone"), "dead_zone.half_width"),
                normalization.c2,
                normalization.c3,
            ),
            dominant_modes=dominant,
            noise_sigma=sigma,
            units=Units.from_dict(data.get("units", {})),
            known=tuple(KnownInput.from_dict(item, rate) for item in _list(data.get("known", []), "known")),
            physical=Physical.from_dict(data["physical"]) if "physical" in data else None,
        )
        linear.check_stable()
        model.mode_indices()
        return model

    def to_dict(self) -> dict[str, Any]:
        """The content of model.json."""
        gains = self.normalization
        return {
            "name": self.name,
            "sample_rate_hz": self.sample_rate_hz,
            "units": self.units.to_dict(),
            "saturation": {"lower": self.saturation.lower, "upper": self.saturation.upper},
            "linear": {
                "zeros": [[z.real, z.imag] for z in self.linear.zeros.tolist()],
                "poles": [[p.real, p.imag] for p in self.linear.poles.tolist()],
                "gain": self.linear.gain,
                "delay_samples": self.linear.delay_samples,
            },
            "dominant_modes": [
                {"frequency_hz": mode.frequency_hz, "damping_ratio": mode.damping_ratio}
                for mode in self.dominant_modes
            ],
            "dead_zone": {"half_width": self.dead_zone.half_width},
            "noise": {} if np.isnan(self.noise_sigma) else {"sigma": self.noise_sigma},
            "normalization": {"c1": gains.c1, "c2": gains.c2, "c3": gains.c3},
            **({"known": [one.to_dict(self.sample_rate_hz) for one in self.known]} if self.known else {}),
            **({"physical": dict(self.physical.content)} if self.physical is not None else {}),
        }

    def __repr__(self) -> str:
        units, saturation = self.units, self.saturation
        modes = ", ".join(f"{mode.frequency_hz:.4g} Hz" for mode in self.dominant_modes) or "none"
        return (
            f"<HammersteinWiener {self.name!r} at {self.sample_rate_hz:g} Hz: limits "
            f"{saturation.lower:.4g} to {saturation.upper:.4g} {units.input}, {len(self.linear.poles)} "
            f"poles, delay {self.linear.delay_samples} samples, modes {modes}, dead zone "
            f"{self.dead_zone.half_width:.3g} {units.output}>"
        )

    def _repr_html_(self) -> str:
        return f"<code>{html.escape(repr(self)[1:-1])}</code>"

    def write(self, path: Path | str) -> None:
        """Write model.json, or an idnlhw structure where the path ends in .mat; see `write_idnlhw`.

        Raises InputError where the polynomials of an idnlhw structure do not tell the roots of this model.
        """
        path = Path(path)
        if path.suffix.lower() == ".mat":
            with temporary_sibling(path) as temporary:
                write_idnlhw(temporary, self.to_dict(), *self.linear.coefficients())
                if not self._is_kept_in(temporary):
                    raise InputError(
                        f"{path}: polynomials of {len(self.linear.poles)} poles and a delay of "
                        f"{self.linear.delay_samples} samples do not hold this model; keep it as .json"
                    )
            return
        write_json(path, self.to_dict())

    def _is_kept_in(self, path: Path) -> bool:
        """Whether the model read from a file answers full steps either way as this one does."""
        try:
            back = type(self).read(path)
        except InputError:
            return False
        limits = np.clip([self.saturation.upper, self.saturation.lower, 0.0], -LARGEST_VALUE, LARGEST_VALUE)
        u = np.repeat(limits, KEPT_SAMPLES + self.linear.total_delay)
        own, other = self.simulate(u).y, back.simulate(u).y
        return bool(np.max(np.abs(own - other)) <= KEPT_TO * max(float(np.ptp(own)), 1e-300))


def _mapping(data: Mapping[str, Any], key: str, optional: bool = False) -> Mapping[str, Any]:
    if key not in data and optional:
        return {}
    value = data.get(key)
    if not isinstance(value, Mapping):
        raise InputError(f"{key}: missing or not an object; see the model.json format")
    return value


def _list(value: Any, label: str) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"{label}: a list was expected; see the model.json format")
    return value


def _number(data: Mapping[str, Any], label: str) -> float:
    """The number under the last part of the dotted `label`."""
    return _finite(data.get(label.rpartition(".")[2]), label)


def _finite(value: Any, label: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{label}: missing or not a number")
    if value != value or abs(value) == float("inf"):
        raise InputError(f"{label}: must be finite")
    if abs(value) > LARGEST_VALUE:
        raise InputError(f"{label}: is beyond {LARGEST_VALUE:g}; correct it, or use a larger unit")
    return float(value)


def _normalization(gains: Mapping[str, Any]) -> GainNormalization:
    for key in gains:
        if key not in ("c1", "c2", "c3"):
            raise InputError(f'normalization: unknown key {key!r}; use "c1", "c2" and "c3"')
    return GainNormalization(**{key: _number(gains, f"normalization.{key}") for key in gains})


def _linear_block(data: Mapping[str, Any]) -> LinearBlock:
    if "numerator" in data or "denominator" in data:
        return LinearBlock.from_coefficients(_numbers(data, "numerator"), _numbers(data, "denominator"))
    delay = _number(data, "linear.delay_samples")
    if delay != int(delay):
        raise InputError("linear.delay_samples: must be a whole number of samples")
    if delay > LONGEST_DELAY:
        raise InputError(f"linear.delay_samples: must be at most {LONGEST_DELAY}")
    return LinearBlock(_roots(data, "zeros"), _roots(data, "poles"), _number(data, "linear.gain"), int(delay))


def _numbers(data: Mapping[str, Any], key: str) -> list[float]:
    values = _short_list(data, key)
    if not values:
        raise InputError(f"linear.{key}: must hold at least one number")
    return [_finite(value, f"linear.{key}[{index}]") for index, value in enumerate(values)]


def _roots(data: Mapping[str, Any], key: str) -> ComplexArray:
    values = _short_list(data, key)
    roots = np.empty(len(values), dtype=np.complex128)
    for index, pair in enumerate(values):
        label = f"linear.{key}[{index}]"
        if not isinstance(pair, list) or len(pair) != 2:
            raise InputError(f"{label}: must be a pair [re, im]")
        roots[index] = complex(_finite(pair[0], label), _finite(pair[1], label))
    return roots


def _short_list(data: Mapping[str, Any], key: str) -> list[Any]:
    """At most MOST_ROOTS entries, zeros that stand for delay not counted."""
    values = _list(data.get(key), f"linear.{key}")
    delay = next((index for index, value in enumerate(values) if value != 0), 0)
    if len(values) - delay > MOST_ROOTS or delay > LONGEST_DELAY:
        raise InputError(f"linear.{key}: has {len(values)} entries, more than the {MOST_ROOTS} that are read")
    return values


def _mode(item: Any, index: int, rate: float) -> Mode:
    if not isinstance(item, Mapping):
        raise InputError(f"dominant_modes[{index}]: must be an object")
    label = f"dominant_modes[{index}]"
    mode = Mode(_number(item, f"{label}.frequency_hz"), _number(item, f"{label}.damping_ratio"))
    if not 0 < mode.frequency_hz < rate / 2:
        raise InputError(f"{label}.frequency_hz: must lie between 0 and half the sample rate")
    if not 0 < mode.damping_ratio < 1:
        raise InputError(f"{label}.damping_ratio: must lie between 0 and 1")
    return mode
