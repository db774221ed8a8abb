"""What is added to posterior.json: the check of the intervals (--check N) and the structures weighed."""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bayes_hw import __version__
from bayes_hw.commands.speech import say, warn
from bayes_hw.errors import InputError
from bayes_hw.executor import ResultFolder, make_executor
from bayes_hw.files import read_small_text, write_json
from bayes_hw.infer.checkpoint import fingerprint
from bayes_hw.infer.own_check import OwnCheck, check_own_axis
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.progress import Progress
from bayes_hw.record import Record


def checked(
    parsed: argparse.Namespace,
    out: Path,
    posterior: Posterior,
    records: Sequence[Record],
    settings: SamplerSettings,
) -> OwnCheck:
    """Run `parsed.check` replicates, those that OUT/check already has left out."""
    digests = [hashlib.sha256(record.u.tobytes() + record.y.tobytes()).hexdigest() for record in records]
    drawn = hashlib.sha256(posterior.values.tobytes()).hexdigest()
    folder = out / "check"
    folder.mkdir(parents=True, exist_ok=True)
    kept = ResultFolder(folder, fingerprint(__version__, *digests, drawn, str(parsed.seed), repr(settings)))
    return check_own_axis(
        posterior,
        records,
        parsed.check,
        parsed.seed,
        make_executor(parsed.jobs),
        settings=settings,
        kept=kept,
        progress=Progress(parsed.quiet),
    )


def write_check(out: Path, check: OwnCheck) -> None:
    """The outcome into posterior.json in `out`."""
    _add(out, {"check": check.to_dict()})


def structure_in(model: Path) -> dict[str, Any] | None:
    """What a model.json says of the structures that it was chosen from; None where it says nothing."""
    try:
        found = json.loads(read_small_text(model)).get("structure")
    except (InputError, OSError, ValueError, AttributeError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def write_structure(out: Path, structure: dict[str, Any] | None) -> None:
    """The same into posterior.json in `out`."""
    if structure is not None:
        _add(out, {"structure": structure})


def _add(out: Path, entries: dict[str, Any]) -> None:
    path = out / "posterior.json"
    content = json.loads(path.read_text(encoding="utf-8")) | entries
    write_json(path, content)


def say_check(check: OwnCheck) -> None:
    """The shares held, and what they say."""
    whole = check.all_parameters
    say(
        f"check: in {check.replicates} replicates ({check.converged} converged) {whole.held} of {whole.of}"
        f" intervals of 94 % held the values simulated with, {100 * whole.held / whole.of:.0f} %"
    )
    for name, one in check.held.items():
        low, high = one.interval95
        say(f"  {name:32} {one.held} of {one.of}, 95 % interval {100 * low:.0f} to {100 * high:.0f} %")
    if check.refuted:
        warn(f"the intervals of {', '.join(check.refuted)} do not hold as often as 94 %")
