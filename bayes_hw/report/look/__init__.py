"""The page of bayes-hw look."""
