"""What several pages show of an axis: its response, its errors over speed and position, what trades places."""
