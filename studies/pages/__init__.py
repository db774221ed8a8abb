"""Pages and figures that only studies make."""
