"""Simulation against reality: which effect is missing, where, and how far adding it shrinks the gap."""
