"""idnlhw structures: known answers from MATLAB's own conventions, round trips, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from printed.nanshan import nanshan_model
from twin import twin_records

from bayes_hw.errors import InputError
from bayes_hw.model.blocks import DeadZone
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

B, F = [0.02, 0.01], [1.0, -1.5, 0.7]


def exported(**changes: Any) -> dict[str, Any]:
    """What an idnlhw of two delays looks like once its objects are structures."""
    fields: dict[str, Any] = {
        "Name": "az",
        "Ts": 0.05,
        "TimeUnit": "seconds",
        "InputNonlinearity": {"LinearInterval": [-0.4, 0.5], "NumberOfUnits": 1.0},
        "LinearModel": {"B": [0.0, 0.0, *B], "F": F, "nk": 2.0},
        "OutputNonlinearity": {"ZeroInterval": [-0.01, 0.01]},
        "NoiseVariance": 0.0004,
        "InputUnit": "rpm",
        "OutputUnit": "mrad",
    }
    return {name: value for name, value in (fields | changes).items() if value is not None}


def read(folder: Path, **changes: Any) -> HammersteinWiener:
    path = folder / "model.mat"
    scipy.io.savemat(path, {"m": exported(**changes)}, oned_as="row")
    return HammersteinWiener.read(path)


def reference(u: np.ndarray) -> np.ndarray:
    """The same model computed sample by sample from its difference equation."""
    v = np.clip(u, -0.4, 0.5)
    w = np.zeros(len(u))
    for k in range(len(u)):
        past = sum(b * v[k - 2 - i] for i, b in enumerate(B) if k - 2 - i >= 0)
        w[k] = past - sum(f * w[k - 1 - i] for i, f in enumerate(F[1:]) if k - 1 - i >= 0)
    return np.sign(w) * np.maximum(np.abs(w) - 0.01, 0)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"LinearModel": {"B": B, "F": F, "nk": 2.0}},
        {"LinearModel": {"B": [0.0, 0.0, *B], "F": F, "nk": 2.0, "nb": 2.0}},
        {"LinearModel": None, "B": np.array([[0.0, 0.0, *B], 0], dtype=object)[:1], "F": F, "nk": 2.0},
        {"LinearModel": {"B": [0.0, 0.0, *B], "F": F}},
    ],
)
def test_it_simulates_as_its_difference_equation(tmp_path: Path, changes: dict[str, Any]) -> None:
    """Delays as zeros of B, or in nk alone; B and F in a structure, at the top, or in a cell."""
    model = read(tmp_path, **changes)
    u = np.random.default_rng(1).normal(0, 0.5, 200)
    np.testing.assert_allclose(model.simulate(u).y, reference(u), atol=1e-12)


def test_it_keeps_name_units_rate_and_noise(tmp_path: Path) -> None:
    model = read(tmp_path)
    assert (model.name, model.units.input, model.units.output) == ("az", "rpm", "mrad")
    assert model.sample_rate_hz == 20.0
    assert model.noise_sigma == pytest.approx(0.02)
    assert len(model.dominant_modes) == 1
    assert np.isnan(read(tmp_path, NoiseVariance=None).noise_sigma)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"Ts": 0.0}, "m.Ts: is 0 seconds; export a discrete model"),
        ({"TimeUnit": "minutes"}, "m.Ts: is 0.05 minutes"),
        ({"InputNonlinearity": "unitgain"}, "m.InputNonlinearity: is not a structure"),
        (
            {"InputNonlinearity": {"LinearInterval": [-np.inf, 1]}},
            "LinearInterval: is not two finite numbers",
        ),
        ({"OutputNonlinearity": {"ZeroInterval": [-0.02, 0.01]}}, "is -0.02 to 0.01; give one symmetric"),
        ({"LinearModel": {"B": np.eye(2), "F": F, "nk": 1.0}}, "m.B: is not one row"),
        ({"LinearModel": {"B": B, "F": F, "nk": 0.5}}, "m.nk: is not one whole number"),
        ({"LinearModel": {"B": B, "F": [1.0, -2.5], "nk": 1.0}}, "unstable, |pole| = 2.5"),
        ({"LinearModel": {"B": np.ones(5000), "F": F}}, "has 5000 entries, more than the 200"),
        ({"LinearModel": {"B": np.ones(20_000), "F": F}}, "holds more than 11,000 numbers"),
        ({"InputNonlinearity": None}, "holds 0 structures with InputNonlinearity"),
        ({"DominantModes": np.zeros((2, 3))}, "m.DominantModes: is not a matrix of two columns"),
    ],
)
def test_what_is_no_such_model_is_refused(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, **changes)
    message = str(caught.value)
    assert said in message and "\n" not in message and str(tmp_path) in message


def test_a_round_trip_leaves_the_simulation(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    """Poles go through polynomial coefficients, which for three poles keep them to 1e-12; for the 26 m model,
    whose poles cluster at z = 1, the simulated twin stays within 1e-6 of its travel."""
    small_axis.write(tmp_path / "small.mat")
    back = HammersteinWiener.read(tmp_path / "small.mat")
    assert back.name == small_axis.name
    assert back.linear.total_delay == small_axis.linear.total_delay
    np.testing.assert_allclose(
        np.sort_complex(back.linear.poles), np.sort_complex(small_axis.linear.poles), atol=1e-12
    )
    assert [m.frequency_hz for m in back.dominant_modes] == [
        m.frequency_hz for m in small_axis.dominant_modes
    ]
    twin = nanshan_model(0.006, 0.003)
    twin.write(tmp_path / "twin.mat")
    u = twin_records(np.random.default_rng(1)).train[0].u
    expected = twin.simulate(u).y
    found = HammersteinWiener.read(tmp_path / "twin.mat").simulate(u).y
    np.testing.assert_allclose(found, expected, atol=1e-6 * float(np.ptp(expected)))


def test_a_long_delay_survives_a_round_trip(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    from dataclasses import replace

    slow = replace(small_axis, linear=replace(small_axis.linear, delay_samples=5000))
    slow.write(tmp_path / "slow.mat")
    assert HammersteinWiener.read(tmp_path / "slow.mat").linear.delay_samples == 5000


def test_a_model_that_polynomials_do_not_hold_is_not_written(
    small_axis: HammersteinWiener, tmp_path: Path
) -> None:
    """150 poles: their product's coefficients tell no roots, which came back outside the unit circle."""
    from dataclasses import replace

    rng = np.random.default_rng(0)
    upper = rng.uniform(0.3, 0.98, 75) * np.exp(1j * rng.uniform(0.1, 3.0, 75))
    linear = replace(small_axis.linear, poles=np.concatenate([upper, upper.conj()]))
    many = replace(small_axis, linear=linear, dominant_modes=())
    with pytest.raises(InputError, match=r"many.mat: polynomials of 150 poles .* keep it as .json"):
        many.write(tmp_path / "many.mat")
    assert list(tmp_path.iterdir()) == []


def test_gains_that_idnlhw_lacks_are_not_dropped(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    from dataclasses import replace

    freed = replace(small_axis, dead_zone=DeadZone(0.02, 1.0, 0.9))
    with pytest.raises(InputError, match="idnlhw has no gains"):
        freed.write(tmp_path / "freed.mat")
    assert not (tmp_path / "freed.mat").exists()
