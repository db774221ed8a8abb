"""The catalogue: one walk over every effect, and effects that other packages register."""

from __future__ import annotations

import re
import shutil
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import EntryPoint
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from drive_axis import RATE, SIGMA, command, drive_axis, hypothesis, white
from fitted import simulated_with

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.answer.sentence import sentence
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.diagnosis import diagnose
from bayes_hw.gap.effects import catalogue as catalogue_module
from bayes_hw.gap.effects.catalogue import ENTRY_POINT_GROUP, block_of, catalogue, known_labels
from bayes_hw.gap.effects.effect import Effect, PeriodicEffect, everywhere_periodic
from bayes_hw.gap.effects.labels import BLOCKS, LABEL_BLOCKS, Block
from bayes_hw.gap.effects.linear import CubicStiffness, SofteningStiffness
from bayes_hw.gap.effects.priors import positive
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, Normal
from bayes_hw.record import Record

STOCHASTIC_LABELS = {"wind", "encoder_quantization", "timing_jitter", "outliers"}
CATALOGUE = catalogue()


def with_richer_forms() -> list[Effect]:
    """Every effect of the catalogue, and the forms that it is refined to and that are not in it."""
    found = list(CATALOGUE)
    known = {effect.name for effect in CATALOGUE}
    for effect in CATALOGUE:
        forms = (form for form, _ in effect.refined(np.array(effect.test_values)))
        found += [form for form in forms if form.name not in known]
    return found


HOW_TO = Path(__file__).parents[2] / "docs" / "how-to"


def of_another_package() -> Effect:
    """The effect of the how-to, which stands for any that the program does not come with."""
    place = spec_from_file_location("hot_drive", HOW_TO / "hot_drive.py")
    assert place is not None and place.loader is not None
    module = module_from_spec(place)
    place.loader.exec_module(module)
    found: Effect = module.HotDrive()
    return found


def test_the_how_to_names_every_setting() -> None:
    """A wave by the name of its first row; nothing is named that does not exist."""
    page = (HOW_TO / "add_an_effect.md").read_text()
    rows = re.findall(r"^\| (`.*?`) \|", page, re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`([A-Z_]+)\*?`", row)}
    waves = {name for row in rows for name in re.findall(r"`([A-Z_]+)\*`", row)}
    settings = {name for name, value in vars(S).items() if name.isupper() and isinstance(value, int)} - {
        "COUNT"
    }
    of_waves = {
        name for name in settings for wave in waves if re.match(f"{wave}_(PERIOD|PHASE|SECOND|START)", name)
    }
    assert named - {"READING"} <= settings and settings - named - of_waves - {"READING_ERROR"} == set()


BUILT_IN = with_richer_forms()
EVERY = [*BUILT_IN, of_another_package()]
AXIS = drive_axis()
U = command(200, seed=5)
BASE = hypothesis(AXIS, [U])
SCALE = BASE.scale
Y = AXIS.simulate(U).y


def output(effect: Effect, values: Sequence[float]) -> FloatArray:
    found = hypothesis(AXIS, [U], effect)
    return found.simulate(np.concatenate([found.builder.axis.nominal, values]))[0]


def test_the_labels_are_the_seventeen_of_the_format() -> None:
    assert len(LABEL_BLOCKS) == 17
    assert {effect.label for effect in BUILT_IN} == set(LABEL_BLOCKS) - STOCHASTIC_LABELS
    assert set(LABEL_BLOCKS.values()) == set(BLOCKS)
    names = [effect.name for effect in EVERY]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("effect", EVERY, ids=lambda effect: effect.name)
def test_every_effect_says_what_it_is(effect: Effect) -> None:
    """Docstring, block, parameters LABEL.NAME whose priors are finite where starts and test values are."""
    text = " ".join((type(effect).__doc__ or "").split())
    assert len(text) > 80
    assert effect.block == block_of(effect.label, (effect,))
    parameters = effect.parameters(SCALE)
    assert len(parameters) == len(effect.test_values)
    assert len({p.name for p in parameters}) == len(parameters)
    points = [effect.test_values, tuple(p.nominal or 1e-3 for p in parameters), *effect.starts(SCALE)]
    for point in points:
        assert len(point) == len(parameters)
        for parameter, value in zip(parameters, point, strict=True):
            label, dot, name = parameter.name.partition(".")
            assert label == effect.label and dot and name.isidentifier()
            coordinate = parameter.transform.to_coordinate(np.asarray(value))
            assert np.isfinite(parameter.prior.log_density(np.asarray(value)))
            assert np.isfinite(coordinate)
            back = float(parameter.transform.to_value(coordinate))
            assert back == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("effect", EVERY, ids=lambda effect: effect.name)
def test_every_effect_shows_and_vanishes_with_its_size(effect: Effect) -> None:
    """At its test values it moves the output; at its vanishing values it does not."""
    moved = output(effect, effect.test_values)
    assert np.isfinite(moved).all()
    assert np.sqrt(np.mean((moved - Y) ** 2)) > 1e-5
    np.testing.assert_allclose(output(effect, effect.vanishing_values), Y, rtol=0, atol=1e-6)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_richer_forms_start_where_the_simple_one_is(effect: Effect) -> None:
    """Starts have a value for every parameter and move the output, forms keep label and block. Richer forms
    have none themselves; one of as many parameters, in another place, leads back to where it came from."""
    for form, start in effect.refined(np.array(effect.test_values)):
        assert (form.label, form.block) == (effect.label, effect.block) and form.name != effect.name
        assert len(start) == len(form.parameters(SCALE))
        assert np.abs(output(form, start) - Y).max() > 1e-5
        again = [other.name for other, _ in form.refined(np.array(form.test_values))]
        assert again == ([effect.name] if len(start) == len(effect.test_values) and again else [])


@pytest.mark.parametrize("effect", EVERY, ids=lambda effect: effect.name)
def test_apply_touches_only_its_own_settings(effect: Effect) -> None:
    """Base settings stay: several effects can be applied one after the other."""
    settings = S.NEUTRAL.copy()
    effect.apply(np.array(effect.test_values), settings, SCALE)
    base = [S.LOWER, S.UPPER, S.DEAD_ZONE, S.MOTOR_STIFFNESS, S.LOAD_STIFFNESS, S.CONTACT_DAMPING]
    np.testing.assert_array_equal(settings[base], S.NEUTRAL[base])
    changed = not np.array_equal(settings, S.NEUTRAL)
    assert changed == (effect.resonator(np.array(effect.test_values)) is None)


@pytest.mark.parametrize(
    "effect", [e for e in CATALOGUE if isinstance(e, PeriodicEffect)], ids=lambda effect: effect.name
)
def test_periodic_effects_are_a_sine_and_a_cosine(effect: PeriodicEffect) -> None:
    """Small amplitudes of both add up, which the scan over periods relies on."""
    amplitude = effect.parameters(SCALE)[0].prior
    assert isinstance(amplitude, Normal)
    unit = 5e-5 * amplitude.sd
    period = effect.test_values[2]
    sine, cosine, both = (
        output(effect, (a * unit, b * unit, period)) - Y for a, b in ((1, 0), (0, 1), (1, 1))
    )
    moving = np.abs(AXIS.simulate(U).w) > 2 * AXIS.dead_zone.half_width
    np.testing.assert_allclose(both[moving], (sine + cosine)[moving], atol=0.02 * np.abs(both).max())


def test_labels_can_be_struck() -> None:
    left = catalogue(frozenset({"friction", "backlash"}))
    assert {effect.label for effect in CATALOGUE} - {effect.label for effect in left} == {
        "friction",
        "backlash",
    }


class CableDrag(Effect):
    """An offset of the output gain: what a package of its own could register."""

    label: ClassVar[str] = "cable_drag"
    block: ClassVar[Block] = "drive"
    test_values = (1.1,)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:  # noqa: ARG002
        return (positive("cable_drag.ratio", "", 1.0, 0.1),)

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:  # noqa: ARG002
        settings[S.GAIN_RATIO] = values[0]

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:  # noqa: ARG002
        return [(1.05,)]


NOT_AN_EFFECT = dict


class OfNoBlock(CableDrag):
    """A part of the axis that nothing is looked for in."""

    block: ClassVar[Block] = "load"  # type: ignore[assignment]


class WithoutDoor(PeriodicEffect):
    """Periodic, and where it enters is not said."""

    label, block, test_values = "detent", "drive", (1.0, 1.0, 0.3)

    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:  # noqa: ARG002
        return ()

    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        pass


def register(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    point = EntryPoint("extra", value, ENTRY_POINT_GROUP)

    def points(group: str) -> list[EntryPoint]:
        assert group == "bayes_hw.effects"
        return [point]

    monkeypatch.setattr(catalogue_module, "entry_points", points)


def test_another_package_registers_an_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """One class and one entry point: it is in the catalogue, has a block, and simulates."""
    register(monkeypatch, f"{__name__}:CableDrag")
    added = catalogue()[-1]
    assert added.label == "cable_drag"
    assert block_of("cable_drag", (added,)) == "drive"
    assert np.abs(output(added, (1.1,)) - Y).max() > 1e-3
    assert len(catalogue(frozenset({"cable_drag"}))) == len(CATALOGUE)


def test_the_effect_of_the_how_to_is_registered_and_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Installed as the page says, it is in the catalogue, and a diagnosis of an axis whose drive warms up
    names it rather than the two built-in effects that it joins, with its time and its block."""
    page = (HOW_TO / "add_an_effect.md").read_text(encoding="utf-8")
    (project,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    points = tomllib.loads(project)["project"]["entry-points"][ENTRY_POINT_GROUP]
    shutil.copy(HOW_TO / "hot_drive.py", tmp_path)
    installed = tmp_path / "hot_drive-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: hot-drive\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(
        "\n".join([f"[{ENTRY_POINT_GROUP}]", *(f"{name} = {value}" for name, value in points.items())])
    )
    monkeypatch.syspath_prepend(tmp_path)
    added = catalogue()[-1]
    assert (added.name, block_of("hot_drive", (added,))) == ("hot_drive", "input")

    change, push, time = 0.05, 0.05, 10.0
    inputs = [command(600, seed) for seed in (1, 2, 3)]
    clean = simulated_with(added, (change, push, time), inputs)
    t = np.arange(600) / RATE
    records = [
        Record(str(i), t, u, y + white(len(y), SIGMA, i), RATE, AXIS.units)
        for i, (u, y) in enumerate(zip(inputs, clean, strict=True))
    ]
    case = Case.of_records("warm", replace(AXIS, noise_sigma=SIGMA), records[:2], records[2:])
    rivals = {"hot_drive", "gain_drift", "sensor_drift", "command_bias"}
    found = diagnose(case, np.random.default_rng(1), without=frozenset(known_labels()) - rivals)
    assert found.verdict.answer == ("hot_drive",)
    assert found.verdict.where.block == "input"
    estimate = found.verdict.parameters["hot_drive.time"]
    assert estimate.hdi94[0] < time < estimate.hdi94[1] and estimate.sd < 0.2 * time
    assert found.verdict.gap_holdout.closed > 0.95
    assert "hot drive on the command" in sentence(found)


@pytest.mark.parametrize(
    ("value", "what"),
    [
        ("no_such_package:Thing", "cannot be loaded"),
        (f"{__name__}:no_such_class", "cannot be loaded"),
        (f"{__name__}:NOT_AN_EFFECT", "no subclass of Effect"),
        (f"{__name__}:WithoutDoor", "gives no door$"),
        (f"{__name__}:OfNoBlock", "block 'load'; use one of input, linear, drive"),
    ],
)
def test_a_broken_registration_is_named(monkeypatch: pytest.MonkeyPatch, value: str, what: str) -> None:
    register(monkeypatch, value)
    with pytest.raises(InputError, match=what) as raised:
        catalogue()
    assert "'extra'" in str(raised.value) and "\n" not in str(raised.value)


def test_positive_parameters_are_scanned_by_factors() -> None:
    parameter = positive("a.b", "deg", 2.0, 0.5)
    assert isinstance(parameter.transform, Logarithm)
    assert float(parameter.prior.quantile(np.asarray(0.5))) == pytest.approx(2.0)


def test_scales_follow_the_records() -> None:
    """The speed is the limit where commands pass it, else the largest command."""
    assert SCALE.rate == RATE and SCALE.travel == pytest.approx(np.ptp(Y))
    assert SCALE.speed == pytest.approx(0.32)
    slow = hypothesis(AXIS, [0.1 * U]).scale
    assert slow.speed == pytest.approx(0.1 * np.abs(U).max())
    assert slow.output_speed == pytest.approx(slow.speed * 0.75)


def test_a_spring_that_softens_is_tried_in_the_form_that_keeps_its_sign() -> None:
    """Both are the same for small deflections; one that stiffens has no other form."""
    ((form, start),) = CubicStiffness().refined(np.array([-30.0]))
    assert isinstance(form, SofteningStiffness) and start == (30.0,)
    assert list(CubicStiffness().refined(np.array([30.0]))) == []


def test_limits_that_follow_the_position_are_not_periodic_everywhere() -> None:
    """They show while the command saturates alone; ripple and an eccentric encoder always."""
    assert {e.label for e in everywhere_periodic(CATALOGUE)} == {"torque_ripple", "encoder_eccentricity"}
    assert "saturation_drift" in {e.label for e in CATALOGUE if isinstance(e, PeriodicEffect)}
