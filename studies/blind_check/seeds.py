"""Seeds of blind sets: what the diagnosis is calibrated on, and what its score is reported on, never meet."""

from __future__ import annotations

CALIBRATION_SEEDS = range(1_000, 2_000)
"""Sets that thresholds and probabilities are fitted on."""

REPORT_SEEDS = range(9_000, 12_000)
"""Sets whose score is reported; nothing is ever fitted on them."""
