"""Damaged files against every reader, in a process of its own.

`python fuzz.py SECONDS SEED FOLDER POSTERIOR [PART]`; PART picks formats by their names. It goes on
for SECONDS, and until every reader has refused something.

Good files of every format are changed at random (bytes set, runs cut, repeated, moved or filled, numbers made
huge, the end cut off) and read. A reader may return or raise InputError, whose message is one line. Anything
else is a fault: its file is kept in FOLDER and its traceback printed. The process may take no more than
MOST_MEMORY beyond what its imports took, and one file no more than MOST_SECONDS; a crash of the process
leaves the file that caused it in FOLDER/current.
"""

from __future__ import annotations

import json
import resource
import signal
import struct
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io

from bayes_hw.control.controller import Controller
from bayes_hw.errors import InputError
from bayes_hw.gap.case.case import Case
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import ReadingOptions, Record, Units

MOST_MEMORY = 2**30
MOST_SECONDS = 10.0
SAMPLES = 240
INTERESTING = (0, 1, 0x7F, 0x80, 0xFF, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1)

IN_A_CHILD = ("record.h5", "v73.mat", "posterior.nc")
"""Formats that a child process tries first, which takes a hundred times longer than reading the others."""

ROUNDS_BETWEEN = 20

Reader = Callable[[Path], object]


def corpus(folder: Path, posterior: Path) -> dict[str, tuple[Path, Reader]]:
    """Good files of every format in `folder`, each with its reader."""
    t = np.arange(SAMPLES) / 20
    u, y = np.sin(t), np.cos(t)
    record = Record("good", t, u, y, 20.0, Units())
    files: dict[str, tuple[Path, Reader]] = {}
    for ending in (".csv", ".mat", ".h5", ".parquet"):
        record.write(folder / f"record{ending}")
        files[f"record{ending}"] = (folder / f"record{ending}", Record.read)
    plain = {"t": t, "u": u, "y": y, "exp": {"y": y, "c": np.array([1, "a"], dtype=object)}}
    scipy.io.savemat(folder / "plain.mat", plain)
    files["plain.mat"] = (folder / "plain.mat", Record.read)
    data = {"OutputData": y[:, None], "InputData": u[:, None], "Ts": 0.05, "TimeUnit": "seconds"}
    for compressed in (False, True):
        path = folder / f"iddata_{compressed}.mat"
        scipy.io.savemat(path, {"data": data}, do_compression=compressed)
        files[path.name] = (path, Record.read)
    pd.DataFrame({"t": t, "u": u, "y": y, "s": "x"}).to_parquet(folder / "snappy.parquet")
    files["snappy.parquet"] = (folder / "snappy.parquet", Record.read)
    (folder / "influx.json").write_text(
        json.dumps(
            {
                "results": [
                    {"series": [{"name": "m", "columns": ["t", "u", "y"], "values": np.c_[t, u, y].tolist()}]}
                ]
            }
        )
    )
    files["influx.json"] = (folder / "influx.json", Record.read)
    rows = "".join(f"2026-03-14T22:41:{s:06.3f}Z;{a};{b}\n" for s, a, b in zip(t, u, y, strict=True))
    (folder / "stamps.txt").write_text("# a night\nt;u [deg/s];y [arcsec]\n" + rows)
    bridged = ReadingOptions(gaps="bridge", units={"output": "deg"})
    files["stamps.txt"] = (folder / "stamps.txt", lambda path: Record.read_all(path, bridged))
    fits = pytest.importorskip("astropy.io.fits")
    made = [fits.Column(name, "D", array=values) for name, values in (("t", t), ("u", u), ("y", y))]
    fits.BinTableHDU.from_columns(made).writeto(folder / "night.fits")
    files["night.fits"] = (folder / "night.fits", Record.read)
    with h5py.File(folder / "v73.mat", "w", userblock_size=512) as file:
        for name, values in (("t", t), ("u", u), ("y", y)):
            file[name] = values[None, :]
    files["v73.mat"] = (folder / "v73.mat", Record.read)
    model = HammersteinWiener.read(posterior / "model.json")
    for ending in (".json", ".mat"):
        model.write(folder / f"model{ending}")
        files[f"model{ending}"] = (folder / f"model{ending}", HammersteinWiener.read)
    files["posterior.nc"] = (posterior / "posterior.nc", lambda path: Posterior.read(path.parent))
    controller = {
        "name": "PI",
        "sample_rate_hz": 20,
        "proportional": 40,
        "integral": 10,
        "speed_limit": [-1, 1],
    }
    controller |= {"notches": [{"frequency_hz": 3.3, "numerator_damping": 0.1, "denominator_damping": 0.2}]}
    (folder / "controller.json").write_text(json.dumps(controller))
    files["controller.json"] = (folder / "controller.json", Controller.read)
    case = {"model": "model.json", "train": ["record.csv"], "holdout": ["record.csv"]}
    (folder / "case.json").write_text(json.dumps(case))
    files["case.json"] = (folder / "case.json", lambda path: Case.read(path.parent))
    return files


def changed(good: bytes, rng: np.random.Generator) -> bytes:
    """One to six random changes of `good`."""
    content = bytearray(good)
    for _ in range(rng.integers(1, 7)):
        if not content:
            break
        at = int(rng.integers(len(content)))
        length = int(rng.integers(1, 65))
        match int(rng.integers(8)):
            case 0:
                content[at] = int(rng.integers(256))
            case 1:
                content[at] ^= 1 << int(rng.integers(8))
            case 2:
                del content[at : at + length]
            case 3:
                content[at:at] = content[at : at + length] * int(rng.integers(1, 50))
            case 4:
                other = int(rng.integers(len(content)))
                content[at : at + length] = content[other : other + length]
            case 5:
                kind = str(rng.choice(["<B", "<H", "<I", "<Q", ">I", ">Q"]))
                limit = 256 ** struct.calcsize(kind) - 1
                value = min(int(INTERESTING[rng.integers(len(INTERESTING))]), limit)
                content[at : at + struct.calcsize(kind)] = struct.pack(kind, value)
            case 6:
                content[at : at + length] = bytes(rng.integers(0, 256, length, dtype=np.uint8))
            case 7:
                if rng.random() < 0.3:
                    del content[at:]
    return bytes(content)


@contextmanager
def alarm(seconds: float) -> Iterator[None]:
    """TimeoutError after `seconds`."""

    def ring(*_: object) -> None:
        raise TimeoutError(f"took longer than {seconds:g} s")

    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def limit_memory() -> None:
    """No more address space than is used now and MOST_MEMORY."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def verdict_of(reader: Reader, path: Path) -> str:
    """ "read", "refused", or the traceback of what should not have happened."""
    try:
        with alarm(MOST_SECONDS):
            reader(path)
    except InputError as error:
        return "refused" if len(str(error).splitlines()) == 1 else f"more than one line: {error}"
    except BaseException:
        return traceback.format_exc()
    return "read"


def main() -> int:
    seconds, seed, folder = float(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    rng = np.random.default_rng(seed)
    good = folder / "good"
    good.mkdir(exist_ok=True)
    files = corpus(good, Path(sys.argv[4]))
    limit_memory()
    for name, (path, reader) in files.items():
        assert verdict_of(reader, path) == "read", name
    counts = {name: {"read": 0, "refused": 0} for name in files}
    faults = 0
    end = time.monotonic() + seconds
    names = [name for name in files if not sys.argv[5:] or sys.argv[5] in name]
    rounds = 0
    while time.monotonic() < end or not all(counts[name]["refused"] for name in names):
        rounds += 1
        for name in names:
            if name in IN_A_CHILD and rounds % ROUNDS_BETWEEN != 1:
                continue
            path, reader = files[name]
            target = folder / "current" / path.name
            target.parent.mkdir(exist_ok=True)
            if name == "case.json":
                for other in ("model.json", "record.csv"):
                    (target.parent / other).write_bytes((good / other).read_bytes())
            target.write_bytes(changed(path.read_bytes(), rng))
            found = verdict_of(reader, target)
            if found in ("read", "refused"):
                counts[name][found] += 1
                continue
            faults += 1
            kept = folder / f"fault_{faults}_{path.name}"
            kept.write_bytes(target.read_bytes())
            sys.stdout.write(f"{kept}:\n{found}\n")
            if faults == 20:
                return 1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    sys.stdout.write(json.dumps({"peak_mb": peak / 1024, "counts": counts}) + "\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
