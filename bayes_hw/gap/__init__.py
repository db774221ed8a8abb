"""Simulation against reality: which effect is missing, where, and how far the gap shrinks once it is added."""
