"""Bayesian Hammerstein-Wiener models of telescope servo axes."""

__version__ = "0.1.0"
