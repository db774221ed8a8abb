"""What a fit leaves of the records: causes of noise, tones, jumps and faults of reading."""
