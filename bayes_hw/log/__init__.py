"""A log as it comes: its stamps, its clocks, and the even grid of samples that they give."""
