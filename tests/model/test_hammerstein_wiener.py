"""model.json keeps a model to the bit, and one that cannot be used is refused in one line."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from printed.eq12 import printed_coefficients
from printed.nanshan import nanshan_model
from simulated_records import command

from bayes_hw.errors import InputError
from bayes_hw.model.blocks import GainNormalization
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode


def test_written_and_read_back(tmp_path: Path) -> None:
    model = nanshan_model(noise_sigma=0.0123).normalized(GainNormalization(1.1, 0.9, 1.2))
    model.write(tmp_path / "model.json")
    found = HammersteinWiener.read(tmp_path / "model.json")
    assert found.to_dict() == model.to_dict()
    np.testing.assert_array_equal(found.linear.poles, model.linear.poles)
    assert found.normalization == GainNormalization(1.1, 0.9, 1.2)


def test_keys_are_those_of_the_format() -> None:
    data = nanshan_model(noise_sigma=0.01).to_dict()
    assert data["units"] == {"time": "s", "input": "deg/s", "output": "deg"}
    assert set(data["saturation"]) == {"lower", "upper"}
    assert set(data["linear"]) == {"zeros", "poles", "gain", "delay_samples"}
    assert data["dead_zone"].keys() == {"half_width"} and data["noise"] == {"sigma": 0.01}
    assert all(set(mode) == {"frequency_hz", "damping_ratio"} for mode in data["dominant_modes"])
    json.dumps(data, allow_nan=False)


def test_unknown_noise_stays_unknown() -> None:
    data = nanshan_model().to_dict()
    assert data["noise"] == {}
    assert np.isnan(HammersteinWiener.from_dict(data).noise_sigma)


def test_coefficients_in_powers_of_the_delay_are_accepted(small_axis: HammersteinWiener) -> None:
    b, a = small_axis.linear.coefficients()
    data = small_axis.to_dict()
    data["linear"] = {"numerator": b.tolist(), "denominator": a.tolist()}
    u = command(300, np.random.default_rng(1))
    found, expected = HammersteinWiener.from_dict(data).simulate(u), small_axis.simulate(u)
    np.testing.assert_allclose(found.y, expected.y, atol=1e-10)


def test_simulation_is_the_cascade_of_its_blocks(small_axis: HammersteinWiener) -> None:
    u = command(300, np.random.default_rng(2))
    found = small_axis.simulate(u, initial_position=0.7)
    np.testing.assert_array_equal(found.v, np.clip(u, -0.8, 1.0))
    np.testing.assert_allclose(found.w, 0.7 + small_axis.linear.filter(found.v), atol=1e-12)
    np.testing.assert_array_equal(found.y, small_axis.dead_zone(found.w))


def test_coinciding_poles_are_simulated_exactly(small_axis: HammersteinWiener) -> None:
    """1 / (z - 0.5)^2 has the impulse response (k - 1) 0.5^(k - 2)."""
    linear = LinearBlock(np.zeros(0, complex), np.array([0.5, 0.5 + 0j]), 1.0, 0)
    model = replace(small_axis, linear=linear, dominant_modes=())
    u = np.zeros(20)
    u[0] = 0.5
    k = np.arange(20.0)
    expected = np.where(k >= 2, 0.5 * (k - 1) * 0.5 ** (k - 2), 0)
    np.testing.assert_allclose(model.simulate(u).w, expected, atol=1e-15)


def test_modes_are_put_in_order_and_matched_to_their_poles() -> None:
    model = nanshan_model()
    reversed_modes = replace(model, dominant_modes=model.dominant_modes[::-1])
    assert reversed_modes.dominant_modes == model.dominant_modes
    for mode, index in zip(model.dominant_modes, model.mode_indices(), strict=True):
        assert model.linear.poles[index] == pytest.approx(mode.pole(20.0), abs=1e-9)


def test_two_modes_cannot_share_a_pole(small_axis: HammersteinWiener) -> None:
    twice = replace(small_axis, dominant_modes=(Mode(2.0, 0.1), Mode(2.01, 0.1)))
    with pytest.raises(InputError, match=r"dominant_modes\[1\]: no pole pair"):
        twice.mode_indices()


def changed(path: str, value: Any) -> dict[str, Any]:
    """The content of a good model.json with one entry replaced; None removes it."""
    data = copy.deepcopy(nanshan_model(noise_sigma=0.01).to_dict())
    *parents, last = path.split(".")
    inner: dict[str, Any] = data
    for key in parents:
        inner = inner[key]
    if value is None:
        del inner[last]
    else:
        inner[last] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("sample_rate_hz", None, "sample_rate_hz: missing"),
        ("sample_rate_hz", 0, "sample_rate_hz: must be finite and positive"),
        ("sample_rate_hz", "20", "sample_rate_hz: missing or not a number"),
        ("sample_rate_hz", True, "sample_rate_hz: missing or not a number"),
        ("saturation", [1, 2], "saturation: missing or not an object"),
        ("saturation.lower", 0.5, "saturation: needs lower < 0 < upper"),
        ("saturation.upper", float("inf"), "upper: must be finite"),
        ("dead_zone.half_width", -1, "half_width: must be finite and zero or more"),
        ("linear.gain", 0, "linear.gain: must be finite and not zero"),
        ("linear.delay_samples", 1.5, "delay_samples: must be a whole number"),
        ("linear.delay_samples", -1, "delay_samples: must be zero or more"),
        ("linear.poles", [[1.05, 0.0], *([0.1 * i, 0.0] for i in range(7))], "unstable"),
        ("linear.poles", [[1.0, 0.0], [0.5, 0.5]], "conjugate pairs"),
        ("linear.poles", [[0.5, 0.0]], "improper"),
        ("linear.poles", [[0.5]], r"linear.poles\[0\]: must be a pair"),
        ("linear.zeros", [["a", 0]], r"linear.zeros\[0\]: missing or not a number"),
        ("dominant_modes", {"frequency_hz": 1}, "a list was expected"),
        ("dominant_modes", [3], r"dominant_modes\[0\]: must be an object"),
        ("dominant_modes", [{"frequency_hz": 15, "damping_ratio": 0.1}], "half the sample rate"),
        ("dominant_modes", [{"frequency_hz": 3, "damping_ratio": 1.5}], "between 0 and 1"),
        ("dominant_modes", [{"frequency_hz": 8, "damping_ratio": 0.01}], "no pole pair"),
        ("units", {"time": "ms"}, "units.time"),
        ("normalization.c2", 0, "normalization.c2"),
    ],
)
def test_unusable_models_are_refused(tmp_path: Path, path: str, value: Any, message: str) -> None:
    """One line that names the file and the key."""
    file = tmp_path / "model.json"
    file.write_text(json.dumps(changed(path, value)))
    with pytest.raises(InputError, match=message) as caught:
        HammersteinWiener.read(file)
    assert str(caught.value).startswith(str(file)) and "\n" not in str(caught.value)


def test_the_printed_model_is_refused_as_unstable() -> None:
    data = changed("dominant_modes", [])
    numerator, denominator = printed_coefficients()
    data["linear"] = {"numerator": numerator.tolist(), "denominator": denominator.tolist()}
    with pytest.raises(InputError, match=r"unstable, \|pole\| = 1\.049"):
        HammersteinWiener.from_dict(data)


@pytest.mark.parametrize(
    "content", ["", "{", "[1]", "[" * 100_000, "\x00", '{"sample_rate_hz": NaN}', "null"]
)
def test_files_that_are_no_model(tmp_path: Path, content: str) -> None:
    file = tmp_path / "model.json"
    file.write_text(content)
    with pytest.raises(InputError, match=r"model\.json: ") as caught:
        HammersteinWiener.read(file)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_and_a_missing_file(tmp_path: Path) -> None:
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x81")
    for name in ("binary.json", "none.json"):
        with pytest.raises(InputError, match=name):
            HammersteinWiener.read(tmp_path / name)
