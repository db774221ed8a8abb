"""Which column of a log is its clock, its command, its output: by names, units and numbers."""
