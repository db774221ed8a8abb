"""The blind check: withheld cases are made, diagnosed without their truth, and scored against it."""
