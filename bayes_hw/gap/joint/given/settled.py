"""An explanation around a given model at its end: nothing that its own labels have explains more."""

from __future__ import annotations

from bayes_hw.gap.joint.fit.joint_fit import highest
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.search.effect_moves import port_candidates, slow_causes
from bayes_hw.gap.joint.search.laws_of_states import kicked
from bayes_hw.gap.joint.search.structural import STRUCTURAL_NATS, explained_slowly, finer
from bayes_hw.time_budget import time_is_up


def settled(fit: GivenFit) -> GivenFit:
    """With other ports and forms of its labels, steps within the sample, sizes of its last law begun anew and
    descents under noise of a cause, while one of them gains and noise of higher order asks for it.

    What a law at less than its least leaves is slow and coloured, as wind is: a further label is held against
    the present ones where these cannot do better.
    """
    while fit.noise_order > 1 and fit.response.template and not time_is_up():
        trials = [t.descended() for t in port_candidates(fit)]
        best = explained_slowly(finer(highest([fit, *trials])))
        for begun_anew in (_under_a_cause, kicked):
            if best.noise_order > 1:
                best = highest([best, begun_anew(best).descended()])
        if best.score < fit.score + STRUCTURAL_NATS:
            return highest([fit, best])
        fit = best
    return fit


def _under_a_cause(fit: GivenFit) -> GivenFit:
    """Descended under noise of the likelier cause, which weighs what is slow less than white noise
    and takes up less of it than a free one; not descended without. As it is once time is up."""
    caused = slow_causes(fit)
    return highest(caused).with_cause(None) if caused else fit
