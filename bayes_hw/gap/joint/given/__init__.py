"""The same search around a model that was given: its structure held under a prior."""
