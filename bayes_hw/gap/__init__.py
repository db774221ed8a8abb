"""Simulation against reality: where the gap lies, which effect causes it, how far it shrinks."""
