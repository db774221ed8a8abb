"""Axes that MuJoCo simulates: other drive trains and loops than the home plant's (extra `mujoco`)."""
