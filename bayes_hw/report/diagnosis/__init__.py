"""The page of `diagnose`."""
