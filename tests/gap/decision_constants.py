"""Constants by which decisions are worked by hand, not those of the program."""

from __future__ import annotations

from bayes_hw.gap.answer.calibration import Calibration

LABELS = ("friction", "backlash", "wind", "encoder_quantization")
CONSTANTS = Calibration(
    temperature=5.0, single_gain=10.0, pair_gain=12.0, pair_size=0.3, pair_share=0.1, slow_pair_size=0.3,
    slow_pair_share=0.1, left_surprise=40.0, slow_left_surprise=15.0, left_size=0.3, left_share=0.05,
    loose_share=0.3, bent_share=0.2, plain_surprise=60.0, plain_size=0.2, named_block=0.1,
    named_sharpness=2.0, block_sharpness=2.0, chaos_predicted=0.3, left_sharpness=2.0,
    floor=0.001, sigma_log_sd=0.25, largest_penalty=200.0, largest_doubt=0.6, chaos_in_noise=0.1,
    confusable_evidence=6.0, small_share=0.2, failed_scale=2.0, pair_ceiling=0.999,
    other_ceiling=0.999, astray_share=0.0, astray_scale=1.0, sure_enough=0.7)  # fmt: skip
