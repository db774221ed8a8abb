"""The axis, its draws, controllers and weights as objects of python-control (the package `control`)."""

from __future__ import annotations

from collections.abc import Sequence

import control
import numpy as np

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.weight import Weight
from bayes_hw.errors import InputError
from bayes_hw.identify.resonances import LIGHT_DAMPING
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.record import Units


def transfer_function(model: HammersteinWiener) -> control.TransferFunction:
    """G of `model` with its delay, discrete in time, from v (input units) to w (output units)."""
    numerator, denominator = model.linear.coefficients()
    length = max(len(numerator), len(denominator))
    padded = (np.pad(c, (0, length - len(c))) for c in (numerator, denominator))
    return control.tf(*padded, 1 / model.sample_rate_hz, inputs=["v"], outputs=["w"], name=model.name)


def model_of_transfer_function(
    system: control.TransferFunction,
    *,
    saturation: Saturation,
    dead_zone: DeadZone,
    noise_sigma: float = float("nan"),
    units: Units | None = None,
) -> HammersteinWiener:
    """The axis whose G is `system`, discrete in time with one input and one output, in these units.

    The inverse of `transfer_function`; limits and dead zone are no part of a transfer function and have to
    be given. Its lightly damped pole pairs become the dominant modes. Raises InputError on a system that is
    continuous in time, has several inputs or outputs, is improper or unstable.
    """
    if not (system.ninputs == 1 and system.noutputs == 1):
        raise InputError(
            f"transfer function: {system.ninputs} inputs and {system.noutputs} outputs; give that of one axis"
        )
    period = system.dt
    if period is None or period is True or not period > 0:
        raise InputError(
            "transfer function: has no sample time; make it discrete with control.sample_system(system, dt)"
        )
    numerator, denominator = system.num[0][0], system.den[0][0]
    lead = len(denominator) - len(np.trim_zeros(numerator, "f"))
    if lead < 0:
        raise InputError(
            "transfer function: improper, its numerator is of higher degree than its denominator"
        )
    linear = LinearBlock.from_coefficients([*np.zeros(lead), *np.trim_zeros(numerator, "f")], denominator)
    linear.check_stable()
    modes = [mode for mode in linear.modes(1 / period) if mode.damping_ratio < LIGHT_DAMPING]
    return HammersteinWiener(
        name=str(system.name),
        sample_rate_hz=1 / float(period),
        saturation=saturation,
        linear=linear,
        dead_zone=dead_zone,
        dominant_modes=tuple(mode for mode in modes if mode.frequency_hz < 0.5 / period),
        noise_sigma=noise_sigma,
        units=units or Units(),
    )


def nominal_system(posterior: Posterior) -> control.StateSpace:
    """G of the point estimate, see `axis_systems`."""
    return axis_systems(AxisDraws.nominal(posterior))[0]


def posterior_systems(posterior: Posterior, count: int, rng: np.random.Generator) -> list[control.StateSpace]:
    """G of `count` draws of `posterior`, see `axis_systems`."""
    return axis_systems(AxisDraws.of_posterior(posterior, posterior.draws(count, rng)))


def axis_systems(axis: AxisDraws) -> list[control.StateSpace]:
    """G of every draw in modal form, discrete in time, from v (input units) to w (output units).

    State space rather than polynomials: the poles of a drive train cluster at z = 1, where polynomials lose
    their digits.
    """
    n_real, n_pairs, delay = len(axis.real_poles), len(axis.pair_poles), axis.delay_samples
    plant = n_real + 2 * n_pairs
    states = plant + delay
    systems = []
    for draw in range(axis.count):
        a, b, c = np.zeros((states, states)), np.zeros((states, 1)), np.zeros((1, states))
        entry = np.zeros(states)
        for i in range(n_real):
            a[i, i], c[0, i], entry[i] = axis.real_poles[i, draw], axis.real_residues[i, draw], 1
        for m in range(n_pairs):
            i, pole, residue = n_real + 2 * m, axis.pair_poles[m, draw], axis.pair_residues[m, draw]
            a[i : i + 2, i : i + 2] = [[pole.real, -pole.imag], [pole.imag, pole.real]]
            c[0, i : i + 2], entry[i] = [2 * residue.real, -2 * residue.imag], 1
        direct = axis.direct[draw]
        if delay:
            a[:, states - 1] += entry
            c[0, states - 1] = direct
            a[range(plant + 1, states), range(plant, states - 1)] = 1
            b[plant, 0], direct = 1, 0.0
        else:
            b[:, 0] = entry
        systems.append(control.ss(a, b, c, [[direct]], 1 / axis.sample_rate_hz, inputs=["v"], outputs=["w"]))
    return systems


def controller_system(controller: Controller) -> control.TransferFunction | control.StateSpace:
    """C from r - y to u without limits, `delay_samples` included."""
    small = controller.state_space()
    period = controller.period_s
    system = control.ss(small.a, small.b[:, None], small.c[None, :], [[small.d]], period)
    if not controller.delay_samples:
        return system
    delay = control.tf([1.0], [1.0, *np.zeros(controller.delay_samples)], period)
    return system * control.ss(delay)


def loop_systems(loop: Loop) -> Sequence[control.StateSpace]:
    """The open loop L of every draw, at the controller's rate."""
    compensator = controller_system(loop.controller) * loop.axis.loop_gain
    return [system * compensator for system in axis_systems(loop.held)]


def weight_system(weight: Weight) -> control.TransferFunction:
    """W of an uncertainty set, discrete in time at the model's rate."""
    numerator, denominator = weight.transfer_function()
    return control.tf(numerator, denominator, 1 / weight.sample_rate_hz)
