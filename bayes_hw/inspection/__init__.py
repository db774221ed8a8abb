"""What a log file holds, what each column is likely to be, and the command that reads it."""
