"""The page of `identifiability`."""
