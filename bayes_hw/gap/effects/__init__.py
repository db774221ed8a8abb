"""The catalogue of effects that a diagnosis tries, a file a block."""
