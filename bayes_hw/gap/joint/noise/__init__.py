"""What noise in the search from records can be: slow parts, held angles, faults of reading."""
