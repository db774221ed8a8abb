"""What is said: probabilities, the answer, its block, its sentence and how far the gap shrinks."""
