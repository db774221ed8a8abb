"""The page of `report`: identification, posterior, prediction."""
