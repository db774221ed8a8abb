"""Structure, effects and noise descended together; where records begin; a smaller or larger structure."""
