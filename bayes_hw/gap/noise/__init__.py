"""What the encoder adds: noise models and their likelihoods."""
