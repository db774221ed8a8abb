"""What several pages show of an axis: its response, errors over speed and position, what trades places."""
