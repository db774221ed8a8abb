"""How candidate explanations are found: screens, scans and searches over pairs."""
