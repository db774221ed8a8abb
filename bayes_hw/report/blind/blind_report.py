"""The report of a blind check: how often the diagnosis was right on cases whose effect was withheld."""

from __future__ import annotations

from collections.abc import Mapping

from bayes_hw.gap.blind.counts import Share
from bayes_hw.gap.blind.evidence import Evidence
from bayes_hw.gap.blind.score import GOALS, Score
from bayes_hw.provenance import Provenance
from bayes_hw.report.blind.figures_blind import closure_scatter, confusion_matrix, reliability_diagram, shares
from bayes_hw.report.page.document import Badge, Bullets, KeyValues, Paragraph, Report, Section, State, Table
from bayes_hw.report.page.rounding import format_duration, format_number, format_percent

SINGLE = "single effects named right"
NAMED_WRONG = "Cases named wrong"
PROVENANCE = "Provenance"
MOST_CARDS = 4
ORDER: tuple[State, ...] = ("bad", "warn", "good")
"""Of cards: what misses its goal comes first."""


def blind_report(
    score: Score,
    evidence: Evidence,
    provenance: Provenance,
    baselines: Mapping[str, Score] | None = None,
    alone: Score | None = None,
) -> Report:
    """The report whose first page answers: can its answers be trusted?

    `baselines` are other diagnoses' scores on the same cases, by name; `alone` is that of the diagnosis from
    the records alone.
    """
    return Report(
        title="Blind check of the diagnosis",
        subtitle=f"{score.cases} cases whose effect was withheld; {evidence.diagnosis}",
        verdict=_verdict(score),
        badges=_badges(score),
        key_figure=shares(score.by_effect, "Single effects", GOALS[SINGLE]),
        sections=(
            _counts_section(score),
            _probability_section(score),
            _closure_section(score),
            *(() if alone is None else (two_paths_section(score, alone),)),
            *_baseline_sections(score, baselines or {}),
            _check_section(score),
            _cases_section(score),
            _groups_section(score),
            Section(PROVENANCE, (KeyValues(_origin(evidence, provenance)),)),
        ),
    )


def _badges(score: Score) -> tuple[Badge, ...]:
    """The four figures worst against their goals, those that miss theirs first; all stand in the table."""
    found = [
        Badge(
            name,
            share_state(score.headline[name], goal),
            f"{share_text(score.headline[name])}; goal {format_percent(goal)}",
        )
        for name, goal in GOALS.items()
        if score.headline[name].trials
    ]
    return tuple(sorted(found, key=lambda badge: ORDER.index(badge.state))[:MOST_CARDS])


def _verdict(score: Score) -> str:
    head = score.headline
    parts = [
        f"{text} {format_percent(head[name].value)} ({head[name].hits} of {head[name].trials})"
        for name, text in (
            (SINGLE, "a single effect is named right in"),
            ("no false alarm", "nothing is said where there is nothing in"),
            ("other said of off-catalogue", "an effect outside the catalogue is called so in"),
            ("both of a pair named", "both effects of a pair are named in"),
        )
        if head[name].trials
    ]
    sentence = "; ".join(parts)
    cases = "case" if score.failed == 1 else "cases"
    failed = f" {score.failed} {cases} gave no verdict." if score.failed else ""
    return f"{sentence[:1].upper()}{sentence[1:]}.{failed}"


def share_state(entry: Share, goal: float) -> State:
    """Good where the goal is met, bad where it lies above the interval."""
    if entry.value >= goal:
        return "good"
    return "warn" if entry.interval[1] >= goal else "bad"


def _share_table(groups: dict[str, Share], first: str, caption: str) -> Table:
    """Shares by name, with their goals where any has one."""
    rows = tuple((name, share_text(share)) for name, share in groups.items())
    if not any(name in GOALS for name in groups):
        return Table((first, "share, 95 % interval"), rows, caption)
    goals = [format_percent(GOALS[name]) if name in GOALS else "none" for name in groups]
    with_goals = tuple((*row, goal) for row, goal in zip(rows, goals, strict=True))
    return Table((first, "share, 95 % interval", "goal"), with_goals, caption)


def _figure_table(groups: Mapping[str, Mapping[str, Share]], first: str) -> Table:
    names = list(next(iter(groups.values()), {}))
    return Table(
        (first, *names),
        tuple((group, *(_short(figures[name]) for name in names)) for group, figures in groups.items()),
        f"Single effects by {first}: per cent and, in brackets, the 95 % binomial interval.",
        tuple(range(1, len(names) + 1)),
    )


def _short(entry: Share) -> str:
    if not entry.trials:
        return "none"
    low, high = entry.interval
    return f"{100 * entry.value:.0f} [{100 * low:.0f}, {100 * high:.0f}]"


def _counts_section(score: Score) -> Section:
    return Section(
        "What was named",
        (
            _share_table(
                dict(score.headline),
                "figure",
                "Right means exactly: no label more, none less. Every share with its 95 % binomial interval.",
            ),
            confusion_matrix(score.confusion),
            shares(score.by_strength, "By size of the smallest gap in the case, over the noise"),
            shares(score.by_form, "By form of the effect, single and off-catalogue"),
        ),
    )


def _groups_section(score: Score) -> Section:
    return Section(
        "Single effects in numbers",
        (
            _figure_table(score.figures_by_effect, "effect"),
            _figure_table(score.figures_by_strength, "smallest gap / noise"),
        ),
        folded=True,
    )


def _probability_section(score: Score) -> Section:
    return Section(
        "Stated probabilities",
        (
            Paragraph(
                f"Brier score {format_number(score.brier)} (sum over the classes, mean over"
                " the cases; 0 is perfect); stating how often every class occurs in this set would score"
                f" {format_number(score.brier_of_frequencies)}."
            ),
            reliability_diagram(score.reliability, score.answer_reliability),
        ),
    )


def _closure_section(score: Score) -> Section:
    blocks = (
        closure_scatter(score.closures),
        _share_table(
            dict(score.base), "base parameter", "Base parameters whose 94 % interval holds the true value."
        ),
    )
    return Section("How far the gap shrinks, and the base parameters", blocks)


def _baseline_sections(score: Score, baselines: Mapping[str, Score]) -> tuple[Section, ...]:
    if not baselines:
        return ()
    scores = {"this diagnosis": score, **baselines}
    shown = [name for name in score.headline if score.headline[name].trials]
    rows = [
        (name, *(_short(one.headline[name]) for one in scores.values()))
        for name in shown
        if "interval" not in name
    ]
    rows.append(("Brier score", *(format_number(one.brier) for one in scores.values())))
    rows.append(
        (
            "explained fraction of the reducible error, median",
            *(_median_closed(one) for one in scores.values()),
        )
    )
    table = Table(
        ("figure", *scores),
        tuple(rows),
        "Per cent and, in brackets, the 95 % binomial interval. The last row is the true explained "
        "fraction of the hold-out over the cases where something was added.",
        tuple(range(1, len(scores) + 1)),
    )
    return (Section("Baselines on the same cases", (table,)),)


def _median_closed(score: Score) -> str:
    closed = sorted(closure.true for closure in score.closures)
    if not closed:
        return "none"
    return f"{format_percent(closed[len(closed) // 2])} of {len(closed)}"


def _check_section(score: Score) -> Section:
    rows = tuple(
        (m.name, f"{m.before:g}", f"{m.expected:.2f}", f"{m.found:.2f}", "yes" if m.passed else "NO")
        for m in score.mutations
    )
    guesses = tuple(f"guessing {name}: {format_percent(value, 1)}" for name, value in score.chance.items())
    return Section(
        "Would the score notice?",
        (
            Table(
                ("change", "right before", "expected after", "found", "as it should"),
                rows,
                "Cases named right when the truth or the verdicts are spoilt on purpose: the score must fall "
                "to what the confusion matrix says.",
                (1, 2, 3),
            ),
            Paragraph("Chance, on cases without pairs:"),
            Bullets(guesses or ("no such case",)),
        ),
    )


def _cases_section(score: Score) -> Section:
    wrong = [line for line in score.lines if not line.right]
    rows = tuple(
        (
            line.case,
            " + ".join(line.detail) or "none",
            ", ".join(f"{gap:.1f}" for gap in line.gap_over_sigma),
            " + ".join(line.answer) or "none",
            format_percent(line.confidence) if line.confidence == line.confidence else "",
        )
        for line in wrong
    )
    count = (
        f"{len(wrong) or 'None'} of {score.cases} cases. A case took {format_duration(score.median_seconds)} "
        f"(median), {format_duration(score.longest_seconds)} at most."
    )
    columns = ("case", "carries", "gap / noise", "answer", "stated")
    return Section(NAMED_WRONG, (Table(columns, rows, count) if rows else Paragraph(count),))


def _origin(evidence: Evidence, provenance: Provenance) -> tuple[tuple[str, str], ...]:
    return (
        ("seal of the truth", evidence.seal or "none: the truth lay open"),
        ("digest of the verdicts", evidence.verdicts_sha256),
        *provenance.rows(),
    )


WIDE = 0.1
"""Interval of a share that is wider is given without decimals."""


def share_text(entry: Share) -> str:
    """hits of trials, per cent and interval, with as many digits as that has a meaning for."""
    if not entry.trials:
        return "no case"
    low, high = entry.interval
    digits = 0 if high - low > WIDE else 1
    return (
        f"{entry.hits} of {entry.trials}, {format_percent(entry.value, digits)}"
        f" [{100 * low:.{digits}f}, {100 * high:.{digits}f}]"
    )


def two_paths_section(given: Score, alone: Score) -> Section:
    """Shares with 95 % intervals of both paths, and what the second states against what came true."""
    names = [name for name in given.headline if given.headline[name].trials or alone.headline[name].trials]
    rows = [(name, share_text(given.headline[name]), share_text(alone.headline[name])) for name in names]
    rows.append(("Brier score", format_number(given.brier), format_number(alone.brier)))
    rows.append(("cases", str(given.cases), str(alone.cases)))
    rows.append(
        (
            "time a case, median",
            format_duration(given.median_seconds),
            format_duration(alone.median_seconds),
        )
    )
    stated = tuple(
        (f"{format_percent(b.low)} to {format_percent(b.high)}", format_percent(b.mean), share_text(b.share))
        for b in alone.answer_reliability
        if b.share.trials
    )
    return Section(
        "With a model, and from the records alone",
        (
            Paragraph(
                "The second column is of the same cases with their model withheld. There more delay and a "
                "further mode are part of the G that is inferred, and count as no gap."
            ),
            Table(("figure", "model given", "records alone"), tuple(rows), "Shares and 95 % intervals."),
            Table(
                ("stated", "mean", "right"),
                stated,
                "From the records alone: how sure answers were, and how many were right.",
            ),
        ),
    )
