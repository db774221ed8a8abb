"""What the printed digits of the Nanshan model leave open."""
