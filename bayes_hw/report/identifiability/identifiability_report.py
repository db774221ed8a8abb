"""The report on what the records of one axis can and cannot tell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from bayes_hw.identifiability.analysis import Identifiability
from bayes_hw.identifiability.asymmetry import REFERENCE_LOG_SD
from bayes_hw.identifiability.verdict import RULES, ParameterVerdict
from bayes_hw.infer.dead_zone_trade import Trade
from bayes_hw.phrases import listed
from bayes_hw.provenance import Provenance
from bayes_hw.report.axis.axis_sight import trade_blocks
from bayes_hw.report.identifiability.identifiability_sections import (
    assumption_section,
    profile_section,
    ridge_figure,
    ridge_section,
    spectrum_section,
    structure_section,
)
from bayes_hw.report.page.document import (
    Badge,
    Block,
    Bullets,
    Callout,
    KeyValues,
    Paragraph,
    Report,
    Section,
    Table,
)
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_estimate, format_interval, format_number
from bayes_hw.report.page.typography import MINUS, typeset


def identifiability_report(
    result: Identifiability, provenance: Provenance, others: Mapping[str, Identifiability] | None = None
) -> Report:
    """The report whose first page answers: which numbers come from the records, which from us?

    `others` are analyses to set beside it, under their names.
    """
    return Report(
        title=f"{result.title}: what the records can tell",
        subtitle="Identifiability of a Hammerstein-Wiener servo axis",
        verdict=_verdict(result),
        badges=_badges(result),
        key_figure=ridge_figure(result),
        sections=(
            _verdict_section(result),
            structure_section(result),
            ridge_section(result),
            assumption_section(result),
            spectrum_section(result),
            profile_section(result),
            _cancellation_section(result),
            *(_trade_section(result.trade) if result.trade else ()),
            _convergence_section(result),
            *((_comparison_section(result, others),) if others else ()),
            _limits_section(),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(result: Identifiability) -> str:
    sentences = []
    if not result.converged:
        sentences.append("NOT every run has converged; no number below is to be relied on.")
    count = Counter(verdict.verdict for verdict in result.verdicts)
    total = len(result.verdicts)
    weak = [_words(v) for v in result.verdicts if v.verdict == "prior-dominated"]
    if weak:
        sentences.append(
            f"The records say little or nothing about {listed(weak)}: prior-dominated, so that what is "
            "printed for them is what was put in."
        )
    sentences.append(
        f"Of {total} parameters in the paper's normalization, with its two assumptions set free, "
        f"{count['identified']} are identified"
        + (f" and {count['weakly identified']} weakly" if count["weakly identified"] else "")
        + "."
    )
    structure = result.structure
    sentences.append(
        f"With the gains c₁, c₂, c₃ and g all free, {structure.expected} directions are exactly flat, those "
        "of the scaling group: c₁ = c₂ = 1 is a normalization and costs nothing, c₃ = c₂ and equal "
        "thresholds are assumptions."
        if structure.agrees
        else "The flat directions found numerically are NOT those of the scaling group."
    )
    sentences += [
        f"{parameter_name(test.name).symbol} = 1 is {test.decision} by the records."
        for test in result.assumptions
    ]
    return " ".join(sentences)


def _badges(result: Identifiability) -> tuple[Badge, ...]:
    structure, agreement = result.structure, result.agreement
    weak = [v for v in result.verdicts if v.verdict == "prior-dominated"]
    return (
        Badge(
            "flat directions as expected" if structure.agrees else "unexpected flat directions",
            "good" if structure.agrees else "bad",
            f"{structure.expected} at each of {len(structure.flat)} points, largest angle to the scaling "
            f"group {format_number(float(structure.angle.max()), 1)} rad",
        ),
        Badge(
            "invariants agree" if agreement.agrees else "invariants disagree",
            "good" if agreement.agrees else "bad",
            f"largest difference {agreement.largest:.1f} Monte Carlo standard errors (limit "
            f"{agreement.limit:.1f})",
        ),
        Badge(
            "all parameters shown" if not weak else "prior-dominated",
            "good" if not weak else "warn",
            f"{len(result.verdicts) - len(weak)} of {len(result.verdicts)} beyond their priors"
            + (f"; not {', '.join(parameter_name(v.name).symbol for v in weak)}" if weak else ""),
        ),
        *(
            Badge(
                f"{parameter_name(test.name).symbol} = 1 {test.decision}",
                {"supported": "good", "undecided": "warn", "contradicted": "bad"}[test.decision],  # type: ignore[arg-type]
                f"log₁₀ Bayes factor {test.log10_bayes_factor[REFERENCE_LOG_SD][0]:+.1f}",
            )
            for test in result.assumptions
        ),
        Badge(
            "converged" if result.converged else "not converged",
            "good" if result.converged else "bad",
            "three runs: paper's, all gains free, c₁ = c₂ = 1",
        ),
    )


def _verdict_section(result: Identifiability) -> Section:
    rows = tuple(
        (
            _words(v),
            v.verdict,
            _number(v.contraction),
            v.lower_side or "",
            v.upper_side or "",
            _number(v.prior_sensitivity, 2),
            _number(v.likelihood_sensitivity, 2),
        )
        for v in result.verdicts
    )
    reasons = tuple(
        f"{_words(v)}: {typeset(v.reason)}." for v in result.verdicts if v.verdict != "identified"
    )
    blocks: list[Block] = [
        Paragraph("The rules, in the order in which they are asked:"),
        Bullets(RULES),
        Table(
            ("parameter", "verdict", "contraction", "below", "above", "prior", "likelihood"),
            rows,
            "One verdict a parameter, c₁ = c₂ = 1, with the numbers behind it: contraction from prior to "
            "posterior (of the variance; of the logarithm's for c₃ and the negative threshold, which the "
            "paper's run ties), what the profile likelihood does below and above the estimate, and "
            "power-scaling sensitivities to prior and likelihood.",
            (2, 5, 6),
        ),
    ]
    if reasons:
        blocks.append(Bullets(reasons))
    blocks.append(
        Table(
            ("parameter", "verdict", "flat share of its direction"),
            tuple((_words(v), v.verdict, _number(v.flat_share)) for v in result.flat),
            "The same with all gains free: each of these can be moved without any change of any output, if "
            "others move with it. Their values are ours to choose.",
            (2,),
        )
    )
    return Section("Verdicts", tuple(blocks))


def _cancellation_section(result: Identifiability) -> Section:
    if not result.cancellations:
        return Section(
            "Poles and zeros that nearly cancel",
            (
                Paragraph(
                    "None: leaving out any group of poles with as many zeros changes G by 20 % or more."
                ),
            ),
        )
    return Section(
        "Poles and zeros that nearly cancel",
        (
            Table(
                ("poles", "zeros", "frequency (Hz)", "largest change of G"),
                tuple(
                    (
                        ", ".join(_root(root) for root in each.poles),
                        ", ".join(_root(root) for root in each.zeros),
                        format_number(each.frequency_hz),
                        format_number(each.change, 2),
                    )
                    for each in result.cancellations
                ),
                "Groups of poles and zeros of the given model whose common removal changes G by less than "
                "20 % at every frequency. Records say little about them; a shorter model might do as well.",
                (2, 3),
            ),
        ),
    )


def _trade_section(trade: Trade) -> tuple[Section, ...]:
    return (Section("What trades places with the dead zone", trade_blocks(trade)),)


def _convergence_section(result: Identifiability) -> Section:
    runs = (
        ("paper's: c₁ = c₂ = c₃ = 1, equal thresholds", result.inference.posterior),
        ("all gains and thresholds free", result.freed),
        ("c₁ = c₂ = 1, prior of the freed run", result.chart),
    )
    rows = tuple(
        (
            label,
            str(len(run.names)),
            str(run.values[..., 0].size),
            f"{min(s.ess_bulk for s in run.summaries.values()):.0f}",
            f"{max(s.r_hat for s in run.summaries.values()):.4f}",
            "yes" if run.converged else "no",
        )
        for label, run in runs
    )
    blocks: list[Table | Callout] = [
        Table(
            ("run", "parameters", "draws", "smallest effective size", "largest R-hat", "converged"),
            rows,
            "The three runs. R-hat is nested, with the ensembles as superchains.",
            (1, 2, 3, 4),
        )
    ]
    blocks += [
        Callout("bad", f"Not converged: {label}", "; ".join(run.problems))
        for label, run in runs
        if run.problems
    ]
    return Section("Convergence", tuple(blocks))


def _comparison_section(result: Identifiability, others: Mapping[str, Identifiability]) -> Section:
    every = {result.title: result, **others}
    names = list(dict.fromkeys(v.name for each in every.values() for v in each.verdicts))
    verdicts = [{v.name: v.verdict for v in each.verdicts} for each in every.values()]
    tests = tuple(
        (
            title,
            parameter_name(test.name).symbol,
            format_estimate(test.ratio.mean, test.ratio.sd),
            format_interval(*test.ratio.hdi94),
            f"{test.log10_bayes_factor[REFERENCE_LOG_SD][0]:+.1f}".replace("-", MINUS),
            test.decision + (" *" if test.extrapolated else ""),
            "yes" if each.agreement.agrees else "no",
        )
        for title, each in every.items()
        for test in each.assumptions
    )
    return Section(
        "Beside other records",
        (
            Table(
                ("parameter", *every),
                tuple(
                    (parameter_name(name).words, *(found.get(name, "") for found in verdicts))
                    for name in names
                ),
                "Verdicts on other records, by the same rules.",
            ),
            Table(
                ("records", "ratio", "posterior", "94 % HDI", "log₁₀ BF", "equality", "invariants agree"),
                tests,
                "The two assumptions on each, and whether the invariants of the run with all gains free "
                "agree with those of the normalized run. Bayes factors for a prior of log sd "
                f"{REFERENCE_LOG_SD:g}; * from a normal fit to draws that do not reach one.",
                (2, 3, 4),
            ),
        ),
    )


def _limits_section() -> Section:
    return Section(
        "What was not checked",
        (
            Bullets(
                (
                    "The other roots of G are held as given, so that the verdicts hold for the dominant "
                    "modes.",
                    "Profiles hold the noise at its estimate; they are local around the best point found.",
                    "The Bayes factors are for priors of the stated widths; a narrower one says less.",
                    "Effects outside the model are not seen here, and can pass for an asymmetry.",
                )
            ),
        ),
    )


def _words(verdict: ParameterVerdict) -> str:
    return parameter_name(verdict.name).words


def _number(value: float | None, digits: int = 3) -> str:
    return "" if value is None else format_number(value, digits)


def _root(root: complex) -> str:
    if root.imag == 0:
        return format_number(root.real, 4)
    sign = "+" if root.imag > 0 else "−"
    return f"{format_number(root.real, 4)} {sign} {format_number(abs(root.imag), 3)}i"
