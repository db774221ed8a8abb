"""Structure of G, effect and noise inferred together from records alone."""
