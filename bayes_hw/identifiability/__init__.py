"""What the data can and cannot tell: symmetry orbits, information spectrum, profiles, the next experiment."""
