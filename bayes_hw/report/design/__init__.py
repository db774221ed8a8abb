"""The page of `design`."""
