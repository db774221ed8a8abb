"""The report of the decision's constants: fitted on which cases, how far from those by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from blind_check.calibrate import (
    BY_HAND,
    DOUBTS,
    FOLDS,
    PRIOR_LOG_SD,
    WEIGHT_OF_STRUCK,
    CalibrationFit,
    names_fitted,
)
from blind_check.tails import LEVEL, TailFit

from bayes_hw.gap.answer.base_average import DEGREES_ASTRAY
from bayes_hw.gap.answer.judgement import Judgement
from bayes_hw.gap.blind.counts import ReliabilityBin, Share, reliability, share
from bayes_hw.provenance import Provenance
from bayes_hw.report.blind.blind_report import share_text
from bayes_hw.report.page.document import Badge, Figure, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.drawing import drawing_settings, finished, new_canvas
from bayes_hw.report.page.palette import BLUE, INK, MUTED, VERMILLION
from bayes_hw.report.page.rounding import format_percent

COLUMNS = 4
MEANING = {
    "temperature": "divides log-evidences",
    "single_gain": "least gain in log-evidence of one effect",
    "pair_gain": "least gain in log-evidence of a second effect",
    "pair_size": "least error removed by a second effect (noise)",
    "pair_share": "the same as a share of the gap",
    "slow_pair_size": "least size of a stochastic second effect (noise)",
    "slow_pair_share": "least share of innovations explained beside slow noise",
    "left_surprise": "surprise left at even odds of other (nats)",
    "slow_left_surprise": "the same beside slow noise (nats)",
    "left_size": "size left at even odds of other (noise)",
    "left_share": "share of the gap that may be left",
    "loose_share": "the same where the effect cannot be followed",
    "bent_share": "share of wind through a bent path that may be left",
    "plain_surprise": "surprise of a function at even odds where all is followed (nats)",
    "plain_size": "its size at even odds there (noise)",
    "named_block": "probability of the named effect's block at even odds of other",
    "named_sharpness": "power of a block's surprise in its odds there",
    "block_sharpness": "the same where the probability of a block is stated",
    "left_sharpness": "steepness of the odds of other",
    "floor": "least doubt",
    "pair_ceiling": "largest probability of a label of a pair",
    "other_ceiling": "largest probability of other",
}


def decision_report(
    fit: CalibrationFit,
    tails: TailFit,
    seeds: Mapping[str, tuple[Sequence[int], int]],
    provenance: Provenance,
) -> Report:
    """The report on a fit of cases of `seeds`: by kind the seeds of its sets and its number of cases.

    `tails` are of the base parameters of the same cases.
    """
    gain, error = fit.gain
    adopted = fit.adopted is fit.fitted
    before, after = (share(fit.right(judgements)) for judgements in (fit.by_hand, fit.left_out))
    return Report(
        title="Constants of the decision",
        subtitle=f"Fitted on {len(fit.cases)} simulated cases, judged by cases left out of the fit",
        verdict=f"Fitted constants state probabilities that are {'better' if gain > 0 else 'no better'} than"
        f" those by hand, by {gain:.3f} ± {error:.3f} nats a case on cases left out;"
        f" {'they' if adopted else 'those by hand'} go with the program. Answered right: by hand"
        f" {share_text(before)}, fitted without the case {share_text(after)}.",
        badges=(
            Badge("adopted", "good" if adopted else "warn", "fitted constants" if adopted else "by hand"),
            Badge(
                "clear of chance",
                "good" if abs(gain) > 2 * error else "warn",
                f"gain {gain / error if error > 0 else 0.0:.1f} standard errors",
            ),
        ),
        key_figure=profiles(fit),
        sections=(
            Section("The constants", (_table(fit), Paragraph(_chosen(fit)), Paragraph(_method(seeds)))),
            Section("Are stated probabilities kept?", (_reliability(fit), Paragraph(_said_of_blocks(fit)))),
            _base_section(tails),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _method(seeds: Mapping[str, tuple[Sequence[int], int]]) -> str:
    sets = "; ".join(f"{number} {kind}, {_seeds_text(own)}" for kind, (own, number) in seeds.items())
    return (
        f"The cases ({sets}) are of the seeds kept for calibration; the blind check reports on others. A fit"
        " takes the largest sum of the logarithms of the probabilities stated for every label, with a normal"
        f" prior on the logarithm of every constant (standard deviation {PRIOR_LOG_SD:g}) about the one set"
        " by hand, whose cases were others again. Constants that few cases decide stay where they were."
        f" Left out means: fitted on {FOLDS - 1} of {FOLDS} parts of the cases, judged on the other. What"
        f" changes no answer, only how sure it is ({', '.join(DOUBTS)}), is fitted to judgements of cases"
        " left out: constants that suit the answers at hand make them look surer than others are. Cases whose"
        f" effect is struck from the catalogue have a weight of {WEIGHT_OF_STRUCK:g}, and a say in the doubts"
        " of blocks only."
    )


def _seeds_text(seeds: Sequence[int]) -> str:
    return f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"


def _chosen(fit: CalibrationFit) -> str:
    said = "; ".join(
        f"{count} constants fitted, {gain:.3f} ± {error:.3f} nats"
        for count, (gain, error) in fit.gains.items()
    )
    return (
        f"Gains over constants by hand, on cases left out whose catalogue is complete: {said}. Kept is the"
        f" fit of the fewest constants, {len(fit.names)}, that scores within a standard error of the best:"
        f" {', '.join(fit.names)}. The others stay as set by hand."
    )


def _table(fit: CalibrationFit) -> Table:
    return Table(
        ("constant", "what it is", "by hand", "fitted"),
        tuple(
            (name, MEANING[name], f"{getattr(BY_HAND, name):.3g}", f"{getattr(fit.fitted, name):.3g}")
            for name in names_fitted()
        ),
        "Constants of a decision before and after the fit.",
        (2, 3),
    )


def profiles(fit: CalibrationFit) -> Figure:
    names = names_fitted()
    rows = -(-len(names) // COLUMNS)
    lowest = min(float(np.min(scores)) for _, scores in fit.profiles.values())
    highest = max(float(np.max(scores)) for _, scores in fit.profiles.values())
    room = 0.08 * (highest - lowest) + 1e-6
    with drawing_settings():
        canvas = new_canvas(0.4 + 1.05 * rows)
        grid = canvas.subplots(rows, COLUMNS, sharey=True, squeeze=False)
        for axes, name in zip(grid.flat, names, strict=False):
            values, scores = fit.profiles[name]
            axes.plot(values, scores, color=BLUE, linewidth=1.4)
            axes.axvline(getattr(BY_HAND, name), color=MUTED, linestyle="--", linewidth=0.9)
            axes.axvline(getattr(fit.fitted, name), color=VERMILLION, linewidth=0.9)
            axes.set_title(name, size=7)
            axes.tick_params(labelsize=6)
            axes.set_ylim(lowest - room, highest + room)
        for axes in grid[:, 0]:
            axes.set_ylabel("score (nats)", size=7)
        for axes in grid.flat[len(names) :]:
            axes.remove()
        return finished(
            canvas,
            "Mean log score a case, by weight, against every constant, the others as fitted (units as in the"
            " table). Grey, dashed: by hand; orange: fitted, where the prior has a say too, and of what"
            " changes no answer the cases left out.",
            f"Profiles of the score along {len(names)} constants.",
        )


def _base_section(tails: TailFit) -> Section:
    gain, error = tails.gain
    (alone, with_tails), astray = tails.held(), tails.tails
    text = (
        "No explanation is quite right, so that its posterior is too sure of the base model. Of the true base"
        f" parameters of the same cases {share_text(alone)} lay within {format_percent(LEVEL)} intervals."
        f" Errors in units of the stated standard deviation are normal but for {format_percent(astray.share)}"
        f" that follow a t distribution of {DEGREES_ASTRAY} degrees of freedom, {astray.scale:.2g} times as"
        f" wide: better than a normal one by {gain:.2g} ± {error:.2g} nats a case left out. Intervals of that"
        f" distribution, fitted without the case, hold {share_text(with_tails)}. Verdicts draw base"
        " parameters from it."
    )
    return Section("Are intervals of base parameters kept?", (Paragraph(text), _coverage(tails)))


def _coverage(tails: TailFit) -> Figure:
    levels = np.array([0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.94, 0.97, 0.99])
    held = [tails.held(float(level)) for level in levels]
    with drawing_settings():
        canvas = new_canvas(3.0)
        axes = canvas.subplots()
        axes.axhline(0.0, color=INK, linewidth=0.8, linestyle="--")
        kinds = (("posterior alone", MUTED, 0, "s"), ("with tails, left out", BLUE, 1, "o"))
        for name, colour, which, marker in kinds:
            off = [100 * (pair[which].value - level) for pair, level in zip(held, levels, strict=True)]
            axes.plot(100 * levels, off, marker, color=colour, linestyle="-", markersize=4, label=name)
        axes.set(xlabel="stated probability of the interval (%)", ylabel="held less stated (points)")
        axes.legend(loc="lower left")
        return finished(
            canvas,
            "How many more true base parameters central intervals hold than they state.",
            "Coverage of base parameters' intervals.",
        )


def bins(fit: CalibrationFit, judgements: Sequence[Judgement]) -> list[ReliabilityBin]:
    """Every stated probability of a label against whether the label was true."""
    stated, true = [], []
    for case, judgement in zip(fit.cases, judgements, strict=True):
        for label, probability in judgement.probability.items():
            stated.append(probability)
            true.append(label in case.true)
    return reliability(stated, true)


def _said_of_blocks(fit: CalibrationFit) -> str:
    (hits, by_hand), (_, fitted) = (stated_of_blocks(fit, j) for j in (fit.by_hand, fit.left_out))
    if not hits.trials:
        return "No case had one effect, so that nothing is said of the blocks of causes without a name."
    return (
        "Where one effect enters, as functions say that know of no effect: the block they hold the most"
        f" probable was right in {share_text(hits)}, where {format_percent(by_hand)} was stated on average by"
        f" hand, and {format_percent(fitted)} fitted without the case."
    )


def stated_of_blocks(fit: CalibrationFit, judgements: Sequence[Judgement]) -> tuple[Share, float]:
    """In how many cases of one effect the most probable block was right, and its mean probability."""
    pairs = zip(fit.cases, judgements, strict=True)
    of_one = [(case, judged.blocks) for case, judged in pairs if case.block in judged.blocks]
    most = [max(blocks, key=lambda block: blocks[block]) for _, blocks in of_one]
    hits = share([case.block == block for (case, _), block in zip(of_one, most, strict=True)])
    stated = [blocks[block] for (_, blocks), block in zip(of_one, most, strict=True)]
    return hits, float(np.mean(stated)) if stated else 0.0


def _reliability(fit: CalibrationFit) -> Figure:
    with drawing_settings():
        canvas = new_canvas(3.0)
        axes = canvas.subplots()
        axes.plot([0, 1], [0, 1], color=INK, linewidth=0.8, linestyle="--")
        groups = (("by hand", MUTED, fit.by_hand, -0.006), ("fitted, left out", BLUE, fit.left_out, 0.006))
        for name, colour, judgements, aside in groups:
            found = [item for item in bins(fit, judgements) if item.share.trials]
            at = [item.mean + aside for item in found]
            for x, item in zip(at, found, strict=True):
                axes.plot([x, x], item.share.interval, color=colour, linewidth=1.4)
            axes.plot(at, [item.share.value for item in found], "o", color=colour, markersize=4, label=name)
        axes.set(xlabel="stated probability", ylabel="share true", xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))
        axes.legend(loc="upper left")
        worst = max(abs(b.share.value - b.mean) for b in bins(fit, fit.left_out))
        return finished(
            canvas,
            "How often what was said to have a probability was true, with 95 % binomial intervals; largest"
            f" difference on cases left out {format_percent(worst)}.",
            "Reliability by hand and fitted.",
        )
