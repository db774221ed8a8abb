"""Fixtures of several test modules: one BLAS thread, and a small axis with records simulated from it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, browser_program
from command_files import write_axis
from simulated_records import SAMPLE_RATE_HZ, measured
from strokes import draw_strokes
from tried_here import try_here

from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

# Collecting tests makes next to no garbage; `pytest_collection_finish` switches the search for it on again.
gc.disable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whole commands first, short files last: a long one that begins last leaves the other worker idle."""
    items.sort(key=lambda item: item.path.parent != Path(__file__).parent)


def pytest_collection_finish() -> None:
    """What collecting has made stays to the end: no search for garbage need go through it."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)
    gc.enable()


@pytest.fixture(autouse=True, scope="session")
def _one_blas_thread() -> Iterator[None]:
    with one_blas_thread():
        yield


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A headless browser that stays offline; tests that ask for it are skipped where there is none."""
    program = browser_program()
    if program is None:
        pytest.skip("no chromium or google-chrome on the PATH: pages were not looked at")
    with Browser(program, tmp_path_factory.mktemp("profile")) as found:
        yield found


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every figure is a stroke."""
    draw_strokes(monkeypatch)


@pytest.fixture
def tried_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files, which must be sound, are tried in this process."""
    try_here(monkeypatch)


@pytest.fixture(scope="session")
def small_axis() -> HammersteinWiener:
    """An integrator and one mode of 2 Hz at 20 Hz: six parameters without the noise."""
    mode = Mode(2.0, 0.1)
    pole = mode.pole(SAMPLE_RATE_HZ)
    linear = LinearBlock(
        np.array([0.3 + 0j]), np.array([1.0, pole, pole.conjugate()]), gain=0.02, delay_samples=1
    )
    return HammersteinWiener(
        name="small axis",
        sample_rate_hz=SAMPLE_RATE_HZ,
        saturation=Saturation(-0.8, 1.0),
        linear=linear,
        dead_zone=DeadZone(0.02),
        dominant_modes=(mode,),
        noise_sigma=0.01,
    )


@pytest.fixture(scope="session")
def axis_files(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model and three records of the small axis, to be copied."""
    return write_axis(tmp_path_factory.mktemp("axis"), small_axis)


@pytest.fixture(scope="session")
def small_record(small_axis: HammersteinWiener) -> Record:
    """800 samples of the small axis with AR(1) noise, sigma 0.01, correlation 0.5."""
    return measured(small_axis, 800, seed=1)
