"""Growing G pole by pole on the whole cascade with its noise: kernel, descent, candidates, search."""
