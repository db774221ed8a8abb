"""The kept model is the printed one to its four digits, and it can be an axis."""

from __future__ import annotations

from functools import reduce

import mpmath
import numpy as np
import pytest
from printed.eq12 import (
    PRINTED_DENOMINATOR,
    PRINTED_NUMERATOR,
    SLOW_POLE_LIMIT,
    nanshan_rounding_box,
    nanshan_rounding_uncertainty,
    printed_coefficients,
    rounding_half_widths,
)
from printed.nanshan import SAMPLE_RATE_HZ, nanshan_linear_block, nanshan_model
from printed.representative import find_representative


def _expand(roots: np.ndarray) -> list[mpmath.mpf]:
    """Coefficients of prod(z - root), 40 digits."""
    factors = [[mpmath.mpc(1), -mpmath.mpc(complex(root))] for root in roots]

    def multiply(a: list[mpmath.mpc], b: list[mpmath.mpc]) -> list[mpmath.mpc]:
        product = [mpmath.mpc(0)] * (len(a) + len(b) - 1)
        for i, x in enumerate(a):
            for j, y in enumerate(b):
                product[i + j] += x * y
        return product

    return [mpmath.re(c) for c in reduce(multiply, factors, [mpmath.mpc(1)])]


def _to_four_digits(value: mpmath.mpf) -> float:
    return float(mpmath.nstr(value, 4))


def test_printed_model_diverges() -> None:
    """The reason for a representative: the coefficients as printed have a pole well outside the circle."""
    _, denominator = printed_coefficients()
    assert np.abs(np.roots(denominator)).max() == pytest.approx(1.0495, abs=1e-4)


def test_half_widths_follow_the_fourth_digit() -> None:
    numerator, denominator = rounding_half_widths()
    assert numerator.tolist() == [0, 0, 0, 5e-7, 5e-6, 5e-6, 5e-7, 5e-7, 5e-6, 5e-7, 5e-7]
    assert denominator.tolist() == [0, 5e-4, 5e-4, 5e-4, 5e-5, 5e-4, 5e-4, 5e-4, 5e-5, 5e-6]


def test_wider_reading_changes_the_two_short_numbers_only() -> None:
    narrow, wide = nanshan_rounding_box(), nanshan_rounding_box(None)
    texts = [*PRINTED_NUMERATOR, *PRINTED_DENOMINATOR]
    ratio = np.concatenate([wide.numerator_half_width, wide.denominator_half_width])
    narrow_width = np.concatenate([narrow.numerator_half_width, narrow.denominator_half_width])
    changed = {text for text, a, b in zip(texts, ratio, narrow_width, strict=True) if a != b}
    assert changed == {"0.0159", "-0.486"}


def test_representative_rounds_to_every_printed_digit() -> None:
    """In 40-digit arithmetic, so that the three roots near z = 1 cost no accuracy."""
    block = nanshan_linear_block()
    with mpmath.workdps(40):
        numerator = [mpmath.mpf(block.gain) * c for c in _expand(block.zeros)]
        denominator = _expand(block.poles)
        rounded_numerator = [0.0] * block.total_delay + [_to_four_digits(c) for c in numerator]
        rounded_denominator = [_to_four_digits(c) for c in denominator]
    assert rounded_numerator == [float(text) for text in PRINTED_NUMERATOR]
    assert rounded_denominator == [float(text) for text in PRINTED_DENOMINATOR]


def test_representative_is_a_stable_exact_integrator() -> None:
    block = nanshan_linear_block()
    assert np.count_nonzero(block.poles == 1) == 1
    assert np.sort(np.abs(block.poles))[-2] < 0.9913
    slow = np.abs(block.poles[np.abs(block.poles - 1) < 0.1])
    assert np.sort(slow)[-2] <= SLOW_POLE_LIMIT
    block.check_stable()


def test_representative_moves_the_axis_at_one_velocity_gain() -> None:
    """At zero frequency as at 0.5 Hz, above the slow poles and below the resonances, within 1 %."""
    block = nanshan_linear_block()
    plateau = abs(block.frequency_response(np.array([0.5]), SAMPLE_RATE_HZ)[0]) * np.pi
    assert block.velocity_gain(SAMPLE_RATE_HZ) == pytest.approx(plateau, rel=0.01)


def test_search_finds_the_kept_representative() -> None:
    """Poles and zeros agree to 1e-6: the search ends on a flat minimum, so its last digits are its own."""
    found = find_representative(nanshan_rounding_box(), SLOW_POLE_LIMIT)
    kept = nanshan_linear_block()
    assert found.delay_samples == kept.delay_samples
    assert found.gain == pytest.approx(kept.gain, rel=1e-7)
    for roots, expected in ((found.poles, kept.poles), (found.zeros, kept.zeros)):
        distance = np.abs(roots[:, None] - expected[None, :]).min(axis=1)
        assert distance.max() < 1e-6


def test_model_carries_the_printed_limits_and_its_two_resonances() -> None:
    model = nanshan_model(dead_zone_half_width=0.003, noise_sigma=0.01)
    assert (model.saturation.lower, model.saturation.upper) == (-0.335, 0.438)
    assert (model.dead_zone.half_width, model.noise_sigma) == (0.003, 0.01)
    assert model.sample_rate_hz == 20
    assert model.linear.total_delay == 3
    frequencies = [mode.frequency_hz for mode in model.dominant_modes]
    assert frequencies == pytest.approx([3.29, 3.66], abs=0.01)
    poles = model.linear.poles[model.mode_indices()]
    for mode, pole in zip(model.dominant_modes, poles, strict=True):
        assert mode.pole(SAMPLE_RATE_HZ) == pytest.approx(pole, abs=1e-12)


def test_constant_command_moves_the_twin_at_the_velocity_gain() -> None:
    model = nanshan_model(dead_zone_half_width=0)
    w = model.simulate(np.full(4000, 0.1)).w
    velocity = (w[-1] - w[-2]) * SAMPLE_RATE_HZ
    assert velocity == pytest.approx(0.1 * model.linear.velocity_gain(SAMPLE_RATE_HZ), rel=1e-6)


def test_rounding_fixes_the_resonances_but_not_the_sign_of_the_velocity_gain() -> None:
    spread = nanshan_rounding_uncertainty(np.random.default_rng(1), 4000, np.array([0.02, 1.0]))
    assert spread.frequency_hz.shape == spread.damping_ratio.shape
    assert np.ptp(spread.frequency_hz, axis=0).max() < 0.03
    assert (spread.velocity_gain < 0).any()
    assert (spread.velocity_gain > 0).any()
    relative = spread.gain_curve.std(axis=0) / spread.gain_curve.mean(axis=0)
    assert relative[1] < 0.01 < relative[0]
