"""What the `schema` key of a file says, where more than one room writes or reads it."""

from __future__ import annotations

CONTROLLER = "bayes-hw/controller/1"
POSTERIOR = "bayes-hw/posterior/1"
VERDICT = "bayes-hw/verdict/1"
