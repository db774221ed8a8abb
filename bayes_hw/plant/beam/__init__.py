"""Axes of finite elements: shafts, a bending dish, geared stages, one motor or two in current loops."""
