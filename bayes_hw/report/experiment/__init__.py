"""The page of `design-experiment`."""
