"""What the user says of the drive, checked."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from bayes_hw.errors import InputError

if TYPE_CHECKING:
    from bayes_hw.gap.joint.answer.advice import Drive


def drive_of(parsed: argparse.Namespace) -> Drive:
    """From --inertia and --rated-torque; raises InputError unless they are positive."""
    from bayes_hw.gap.joint.answer.advice import Drive

    for option, value in (("--inertia", parsed.inertia), ("--rated-torque", parsed.rated_torque)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{option} {value:g}: must be positive")
    return Drive(parsed.inertia, parsed.rated_torque)
