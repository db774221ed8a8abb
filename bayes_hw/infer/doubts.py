"""What a reader of a posterior must know before its numbers, in words."""

from __future__ import annotations

from bayes_hw.infer.inference import Inference


def said_of(inference: Inference) -> tuple[str, ...]:
    """Whether the sampling has not converged, and whether the model leaves something of the records,
    and whether these are of a closed loop."""
    said = []
    if not inference.posterior.converged:
        said.append("NOT CONVERGED: " + "; ".join(inference.posterior.problems))
    if not inference.residuals.explained:
        said.append(
            f"the model explains little of the records (fit {inference.residuals.fit_percent:.0f} %):"
            " the noise model carries the rest"
        )
    if not inference.residuals.white:
        failed = next(test for test in inference.residuals.tests if not test.passed)
        said.append(f"the residuals are not white: {failed.name}: {failed.meaning}")
    if inference.residuals.feedback.closed_loop:
        said.append(inference.residuals.feedback.sentence)
    return tuple(said)
