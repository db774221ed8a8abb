"""What commands say of a posterior whose model does not hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayes_hw.commands.speech import warn
from bayes_hw.errors import InputError

if TYPE_CHECKING:
    from bayes_hw.gap.answer.axis_with_effects import AxisWithEffects
    from bayes_hw.infer.posterior import Posterior


def refuse_refuted(corrected: AxisWithEffects | None, folder: str) -> None:
    """Raise InputError where something is missing that is not in the model: nothing can rest on it."""
    if corrected is not None and corrected.answer == ("other",) and not corrected.simulated:
        raise InputError(
            f"{folder}: this axis lacks something that was not found, so that no design can rest on its "
            "model; do the next experiment of verdict.json, and diagnose again"
        )


def warn_of_refuted(posterior: Posterior) -> None:
    """A warning where tests of the residuals refute the model that was sampled."""
    if posterior.failed_tests:
        warn(
            f"the model does not hold: {posterior.refuted_by[0]}; bayes-hw diagnose RECORD... --holdout "
            "RECORD finds what it lacks and gives a corrected posterior"
        )
