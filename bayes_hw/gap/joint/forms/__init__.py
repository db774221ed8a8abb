"""Forms of the effects that the search from records proposes, and their parameters."""
