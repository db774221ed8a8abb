"""What is said and handed over: advice, views of an effect, the corrected model."""
