"""What is compared: the case as posed, its simulator and its records."""
