"""Effects proposed and descended, and the search that keeps what the records pay for."""
