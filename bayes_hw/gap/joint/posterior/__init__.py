"""Draws about a fit, and how much of the gap they close."""
