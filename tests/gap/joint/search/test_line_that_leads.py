"""When a line in the residual is taken out before labels are followed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.tone import Tone
from bayes_hw.gap.joint.search.beginning import CONTEST_SHARE, leads
from bayes_hw.gap.joint.search.verification import VERIFIED_NATS


def _fit(score: float) -> JointFit:
    return cast(JointFit, SimpleNamespace(score=score))


@pytest.mark.parametrize(
    ("line", "label", "expected"),
    [
        (2000.0, 2000.0 * CONTEST_SHARE - 1, True),
        (2000.0, 2000.0 * CONTEST_SHARE + 1, False),
        (VERIFIED_NATS - 1, 0.0, False),
    ],
)
def test_a_line_leads_where_no_label_alone_is_a_contender(line: float, label: float, expected: bool) -> None:
    base, trials = _fit(100.0), [_fit(90.0), _fit(100.0 + label)]
    assert leads(Tone(1.0, 0.1, _fit(100.0 + line)), base, trials) == expected
    assert leads(Tone(1.0, 0.1, _fit(100.0 + line)), base, []) == (line > VERIFIED_NATS)
