"""The counts of a score, each against an example worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from blind_cases import truth, verdict

from bayes_hw.gap.blind.counts import (
    Share,
    base_held,
    block_right,
    brier,
    class_statements,
    confidence,
    confusion,
    named_right,
    named_up_to_confusion,
    reliability,
    strength_bin,
    true_closure,
)
from bayes_hw.gap.blind.evidence import FAILED
from bayes_hw.gap.effects.labels import LABEL_BLOCKS


def test_share_has_the_exact_binomial_interval() -> None:
    """9 of 10: Clopper-Pearson [0.555, 0.997]; 0 of 5: upper end 1 - 0.025^(1/5)."""
    assert Share(9, 10).interval == pytest.approx((0.5550, 0.9975), abs=1e-4)
    assert Share(0, 5).interval == pytest.approx((0.0, 1 - 0.025**0.2))
    assert np.isnan(Share(0, 0).value)
    assert Share(0, 0).interval == (0.0, 1.0)


@pytest.mark.parametrize(
    ("carried", "answer", "right"),
    [
        ((), (), True),
        (("wind",), ("wind",), True),
        (("wind", "friction"), ("friction", "wind"), True),
        (("wind",), (), False),
        ((), ("wind",), False),
        (("wind",), ("wind", "friction"), False),
        (("wind", "friction"), ("wind",), False),
        (("other",), ("other",), True),
    ],
)
def test_right_is_exactly_what_the_case_carries(
    carried: tuple[str, ...], answer: tuple[str, ...], right: bool
) -> None:
    assert named_right(truth(*carried), verdict(*answer)) is right


def test_no_verdict_is_never_right() -> None:
    assert not named_right(truth(), FAILED)
    assert confusion([truth()], [FAILED]) == {"none": {"no verdict": 1}}


def test_confusion_that_the_verdict_states_is_counted_apart() -> None:
    said = verdict("friction", confusable=(frozenset(("friction", "backlash")),))
    assert named_up_to_confusion(truth("backlash"), said)
    assert not named_up_to_confusion(truth("wind"), said)
    assert not named_right(truth("backlash"), said)


def test_block() -> None:
    assert block_right(truth("friction"), verdict("backlash", block="drive"))
    assert not block_right(truth("friction"), verdict("backlash", block="input"))
    assert set(LABEL_BLOCKS.values()) == {"input", "linear", "drive", "disturbance", "sensor"}


def test_confusion_matrix_by_hand() -> None:
    truths = [truth("wind"), truth("wind"), truth("friction"), truth(), truth("wind", "friction")]
    verdicts = [verdict("wind"), verdict(), verdict("wind"), verdict(), verdict("wind", "friction")]
    assert confusion(truths, verdicts) == {
        "wind": {"wind": 1, "none": 1},
        "friction": {"wind": 1},
        "none": {"none": 1},
        "two or more": {"two or more": 1},
    }


def test_brier_by_hand() -> None:
    """Sure and right: 0. Sure and wrong: 1 for the class said and 1 for the one missed. Half sure: 0.25."""
    assert brier([truth("wind")], [verdict("wind")]) == 0.0
    assert brier([truth("friction")], [verdict("wind")]) == 2.0
    assert brier([truth("wind"), truth("friction")], [verdict("wind", sure=0.5), verdict("wind")]) == 1.125


def test_confidence_is_that_of_the_least_probable_label() -> None:
    assert confidence(verdict(sure=0.7)) == 0.7
    pair = verdict("wind", "friction", sure=0.8)
    assert confidence(pair) == 0.8


def test_reliability_bins_by_hand() -> None:
    """0.97 and 1.0 share the last bin, 0.95 begins it, 0.3 stands alone."""
    bins = reliability([0.97, 1.0, 0.95, 0.3], [True, True, False, False])
    assert [(b.low, b.high, b.share.hits, b.share.trials) for b in bins] == [
        (0.2, 0.5, 0, 1),
        (0.95, 1.0, 2, 3),
    ]
    assert bins[1].mean == pytest.approx((0.97 + 1.0 + 0.95) / 3)


def test_every_statement_counts_once() -> None:
    stated, true = class_statements([truth("wind"), truth()], [verdict("wind"), verdict("wind")])
    assert len(stated) == 2 * 19
    assert sum(true) == 2
    assert sum(p for p, present in zip(stated, true, strict=True) if present) == 1.0


def test_true_closure_by_hand() -> None:
    """Errors 2 and 1 before, 1 and 0 after: 1 - 1 / 5."""
    said = verdict("wind", before=np.array([2.0, 2.0]), after=np.array([1.0, 1.0]))
    assert true_closure(truth("wind", holdout=[0.0, 1.0]), said) == pytest.approx(0.8)
    assert np.isnan(true_closure(truth("wind", holdout=[0.0]), said))
    assert np.isnan(true_closure(truth("wind", holdout=[2.0, 2.0]), said))


def test_base_intervals() -> None:
    said = verdict(base={"gain": (0.9, 1.1), "noise.sigma": (0.2, 0.3), "mode9.frequency_hz": (0.0, 1.0)})
    assert base_held(truth(), said) == {"gain": True, "noise.sigma": False}


def test_strength_bins() -> None:
    gaps = (0.7, 1.0, 2.5, 8.0)
    names = ["0 to 1", "1 to 2", "2 to 3", "3 or more"]
    assert [strength_bin(truth("wind", gap=gap)) for gap in gaps] == names
    assert strength_bin(truth()) == "none"
