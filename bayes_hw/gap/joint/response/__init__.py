"""The axis simulated with its structure and effects at once, and the derivatives of that."""
