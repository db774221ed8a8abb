"""What noise in the search from records can be: slow parts, a rhythm, faults of reading."""
