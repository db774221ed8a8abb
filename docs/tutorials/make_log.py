"""azimuth_log.csv: a log with names, separator, units and a clock of its own."""

import numpy as np

rng = np.random.default_rng(1)
t = 1000 + np.arange(3000) / 20 + rng.normal(0, 0.004, 3000)
command = 0.005 * np.sin(0.3 * t) + 0.002 * np.sign(np.sin(0.07 * t))
angle = np.cumsum(command) / 20 + rng.normal(0, 2e-5, 3000)
rows = np.column_stack([t, command, angle])
np.savetxt("azimuth_log.csv", rows, delimiter=";", header="time;rate_cmd;enc_angle", comments="", fmt="%.7g")
