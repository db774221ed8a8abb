"""Records a.csv, b.csv and c.csv of the motor behind an amplifier with a dead band of 0.4 V."""

import numpy as np
from my_motor import RATE, speed

rng = np.random.default_rng(3)
for name in ("a", "b", "c"):
    volts = np.repeat(rng.normal(0, 2.0, 60), 20)
    driven = np.sign(volts) * np.maximum(np.abs(volts) - 0.4, 0)
    measured = speed(np.array([[31.0, 0.27]]), driven)[0] + rng.normal(0, 0.5, len(volts))
    t = np.arange(len(volts)) / RATE
    rows = np.column_stack([t, volts, measured])
    np.savetxt(f"{name}.csv", rows, delimiter=",", header="t,u,y", comments="", fmt="%.6g")
