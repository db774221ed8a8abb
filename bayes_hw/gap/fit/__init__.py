"""Parameters of one hypothesis, estimated jointly with the base and the noise."""
