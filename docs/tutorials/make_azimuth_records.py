"""Records a.csv, b.csv and c.csv of an axis that has dry friction of the dish, which azimuth.xml lacks."""

import mujoco
import numpy as np

RATE, SAMPLES, SUBSTEPS = 50.0, 2000, 10
model = mujoco.MjModel.from_xml_path("azimuth.xml")
model.joint("motor").armature[0] *= 1.1
model.joint("azimuth").armature[0] *= 0.93
model.tendon_stiffness[0] *= 1.08
model.joint("azimuth").frictionloss[0] = 0.5
mujoco.mj_setConst(model, mujoco.MjData(model))  # what follows from the inertias

rng = np.random.default_rng(3)
for name in ("a", "b", "c"):
    parts = [np.zeros(50)]
    while sum(map(len, parts)) < SAMPLES:
        count = int(rng.integers(50, 250))
        sine = np.sin(2 * np.pi * rng.uniform(0.1, 2) * np.arange(count) / RATE)
        parts.append((np.full(count, rng.normal()), sine, np.zeros(count))[rng.integers(3)])
    u = np.concatenate(parts)[:SAMPLES]
    data, angle = mujoco.MjData(model), np.empty(SAMPLES)
    for k, command in enumerate(u):
        angle[k] = np.rad2deg(data.joint("azimuth").qpos[0])
        data.ctrl[:] = np.deg2rad(command)
        for _ in range(SUBSTEPS):
            mujoco.mj_step(model, data)
    y = angle + rng.normal(0, 0.002, SAMPLES)
    rows = np.column_stack([np.arange(SAMPLES) / RATE, u, y])
    np.savetxt(f"{name}.csv", rows, delimiter=",", header="t,u,y", comments="", fmt="%.9g")
