"""What only studies do with blind cases: rivals, and cases with an effect left out or made weak."""
