"""The page of `blind score`."""
