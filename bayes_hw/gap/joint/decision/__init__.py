"""Nats of what was found become probabilities of labels."""
