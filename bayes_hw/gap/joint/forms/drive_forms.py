"""Forms without a name that no screen begins with: faults of the drive and of its loop.

The states of G with the command make up whatever the loop sees and asks for, so that a law that looks at them
needs no drive train: a drive that gives no more, or none below, a demand; a measured speed that is wrong by
a share that is periodic in position.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.forms.effect_form import Form, JointScale, Slot
from bayes_hw.gap.joint.forms.joint_forms import FORMS, period_wavenumber, turning_periods

LIMIT_SHARES = (0.05, 0.1, 0.2, 0.4, 0.8)
BAND_SHARES = (0.01, 0.03, 0.1, 0.3)
"""Of the limited command's speed: demands where a drive gives no more, and below which it gives none."""


def _demand(scale: JointScale) -> tuple[Slot, ...]:
    return (Slot(0, "demand", True, 3e-4 * scale.speed, 30 * scale.speed),)


DRIVE_FORMS: tuple[Form, ...] = (
    Form(
        "other", "torque limit of the drive", "law", _demand,
        lambda s: [(share * s.speed,) for share in LIMIT_SHARES],
        K.EXCESS, K.BASE_COMMAND,
    ),
    Form(
        "other", "dead band of the drive", "law", _demand,
        lambda s: [(share * s.speed,) for share in BAND_SHARES],
        K.GAP, K.BASE_COMMAND,
    ),
    Form(
        "other", "speed reading over position", "law",
        lambda s: (period_wavenumber(s, 0), Slot(1, "phase")),
        lambda s: [(2 * np.pi / p, phase) for p in turning_periods(s) for phase in (0.4, 2.0)],
        K.MODULATED, K.BASE_SPEED,
    ),
)  # fmt: skip

OF_DEMAND: tuple[Form, ...] = tuple(form for form in DRIVE_FORMS if form.base == K.BASE_COMMAND)
"""Laws of what the loop asks for."""

GIVEN_FORMS: tuple[Form, ...] = (*FORMS, *DRIVE_FORMS)
"""All that is looked for around a given model, and by laws of the states and exchanges from records alone."""

UNNAMED_OVER_POSITION: tuple[Form, ...] = tuple(
    form
    for form in GIVEN_FORMS
    if form.label == "other"
    and not form.further
    and (form.base == K.BASE_POSITION or form.law == K.MODULATED)
)
