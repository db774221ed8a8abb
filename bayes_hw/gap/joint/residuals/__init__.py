"""What a fit leaves of the records: causes of noise, tones, jumps, a rhythm and faults of reading."""
