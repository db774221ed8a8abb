"""The report of the benchmark: how fast are likelihood and sampler, beside what others would use?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import (
    Badge,
    Block,
    Bullets,
    KeyValues,
    Paragraph,
    Report,
    Section,
    State,
    Table,
)
from bayes_hw.report.page.rounding import format_duration, format_number, format_percent
from pages.figures_performance import Scaling, cost_growth, rates_of_samplers, scaling_figure


@dataclass(frozen=True)
class Rival:
    """One sampler: effective samples per CPU second of every round, empty where it is not installed."""

    name: str
    what: str
    rates: tuple[float, ...]
    goal: float | None = None
    """How many times faster this program's sampler should be."""

    @property
    def rate(self) -> float:
        return float(np.median(self.rates))


@dataclass(frozen=True)
class HardCase:
    """One hard posterior: rate, and the largest difference of a mean from the reference run in standard
    errors of both."""

    name: str
    effective_samples_per_second: float
    seconds: float
    converged: bool
    largest_z: float
    comparisons: int


@dataclass(frozen=True)
class OrderRow:
    """Coverage of the intervals of the axis's parameters with an assumed AR order, and how many replicates
    the residual test names."""

    order: int
    replicates: int
    coverage50: float
    coverage94: float
    not_white: int


@dataclass(frozen=True, eq=False)
class Performance:
    """All that study 06 measures; the first of `samplers` is this program's.

    Kernel times are in ns a walker and sample; `fma_ns` is one multiply-add of one lane, `operations` the
    number that a sample needs at least; `walkers_ns` maps walkers to time.
    """

    kernel_ns: float
    naive_ns: float
    fma_ns: float
    operations: int
    walkers_ns: dict[int, float]
    samples_ns: dict[int, float]
    memory_mb: dict[str, float]
    first_call_seconds: float
    samplers: tuple[Rival, ...]
    start_seconds: float
    default_seconds: float
    default_ess: float
    default_tail_ess: float
    by_parameters: tuple[Scaling, ...]
    by_samples: tuple[Scaling, ...]
    hard: tuple[HardCase, ...]
    true_order: int
    orders: tuple[OrderRow, ...]
    rounds: int
    machine: str

    @property
    def speed_up(self) -> float:
        """Of one log-probability over numpy and lfilter."""
        return self.naive_ns / self.kernel_ns

    @property
    def share_of_peak(self) -> float:
        """Of the core's measured rate of multiply-adds, for the whole call."""
        return self.operations * self.fma_ns / self.kernel_ns

    def ratio(self, rival: Rival) -> float:
        """This program's effective samples a second over the rival's."""
        return self.samplers[0].rate / rival.rate


SPEED_UP_GOAL, SPEED_UP_LEAST, SHARE_GOAL = 60.0, 30.0, 0.6


def performance_report(found: Performance, provenance: Provenance) -> Report:
    """The report whose first page answers: how many times faster?"""
    return Report(
        title="Performance of the inference engine",
        subtitle="Likelihood and sampler beside what others would use, on one core",
        verdict=_verdict(found),
        badges=_badges(found),
        key_figure=rates_of_samplers([(r.name, r.rates) for r in found.samplers if r.rates]),
        sections=(
            _method(found),
            _kernel(found),
            _samplers(found),
            _scaling(found),
            _hard(found),
            _orders(found),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(found: Performance) -> str:
    ratios = [
        f"{_times(found.ratio(rival))} as many as {rival.name}" for rival in found.samplers[1:] if rival.rates
    ]
    return (
        f"A log-probability takes {format_number(found.kernel_ns)} ns a walker and sample: it is"
        f" {_times(found.speed_up)} as fast as numpy with lfilter and reaches"
        f" {format_percent(found.share_of_peak)} of the core's peak. The sampler gives"
        f" {format_number(found.samplers[0].rate, 2)} effective samples a second on the twin's posterior:"
        f" {', '.join(ratios)}."
    )


def _badges(found: Performance) -> tuple[Badge, ...]:
    badges = [
        _goal("likelihood", found.speed_up, SPEED_UP_GOAL, SPEED_UP_LEAST),
        Badge(
            "share of the peak",
            "good" if found.share_of_peak >= SHARE_GOAL else "warn",
            f"{format_percent(found.share_of_peak)}, goal {format_percent(SHARE_GOAL)}",
        ),
    ]
    for rival in found.samplers[1:]:
        if not rival.rates:
            badges.append(Badge(f"no {rival.name}", "warn", "not installed: bayes-hw[benchmark]"))
        elif rival.goal is not None:
            badges.append(_goal(f"over {rival.name}", found.ratio(rival), rival.goal, rival.goal / 2))
    first = found.first_call_seconds
    badges.append(
        Badge("first call", "good" if first < 1 else "warn", f"{first:.2f} s in a fresh process, goal 1 s")
    )
    return tuple(badges)


def _goal(label: str, ratio: float, goal: float, least: float) -> Badge:
    state: State = "good" if ratio >= goal else "warn" if ratio >= least else "bad"
    return Badge(label, state, f"{_times(ratio)}, goal {_times(goal)}")


def _method(found: Performance) -> Section:
    return Section(
        "How it was measured",
        (
            Paragraph(
                f"One process pinned to one core, one thread; {found.machine}. The candidates take turns in"
                f" {found.rounds} rounds, so that what else runs on the machine meets all of them. Times of a"
                " call are the smallest of many; rates of samplers are medians over the rounds, in seconds of"
                " CPU time, which leaves out what other processes took. Warm-up, pilot and diagnostics are"
                " counted, compilation is not. Every sampler starts from the same least-squares estimate"
                f" ({format_duration(found.start_seconds)}, not counted for any)."
            ),
        ),
    )


def _kernel(found: Performance) -> Section:
    rows = [("numpy + scipy.signal.lfilter, one walker after the other", found.naive_ns)]
    rows += [(f"whole call, {walkers} walkers", ns) for walkers, ns in found.walkers_ns.items()]
    longest = max(found.samples_ns)
    rows.append((f"whole call, {longest:,} samples", found.samples_ns[longest]))
    rows.append(("the core's multiply-adds at their peak", found.operations * found.fma_ns))
    table = Table(
        ("log-probability of the twin", "ns a walker and sample", "times lfilter", "share of peak"),
        tuple(
            (
                name,
                format_number(ns),
                format_number(found.naive_ns / ns, 2),
                format_percent(found.operations * found.fma_ns / ns),
            )
            for name, ns in rows
        ),
        "Parameters in, log-probability out. The share counts the"
        f" {found.operations} vector instructions that a sample of this axis (five real poles, two pairs,"
        " AR(1) noise) needs: a multiply-add, a sum, a product, a minimum or a maximum is one each.",
        (1, 2, 3),
    )
    memory = ", ".join(f"{what}: {format_number(mb)} MB" for what, mb in found.memory_mb.items())
    return Section(
        "The likelihood",
        (
            table,
            cost_growth(found.samples_ns, found.walkers_ns),
            Paragraph(
                f"Largest memory of the process after each: {memory}. The first call of a fresh process, with"
                f" the compiled code on disk, takes {found.first_call_seconds:.2f} s."
            ),
        ),
    )


def _samplers(found: Performance) -> Section:
    rows = tuple(
        (
            rival.name,
            rival.what,
            format_number(rival.rate) if rival.rates else "not installed",
            format_number(found.ratio(rival), 3) if rival.rates else "",
            "" if rival.goal is None else format_number(rival.goal, 4),
        )
        for rival in found.samplers
    )
    return Section(
        "The sampler",
        (
            Table(
                ("sampler", "set-up", "effective samples a second", "times slower", "goal"),
                rows,
                "Smallest bulk effective sample size of the ten parameters per CPU second, the median of the"
                " rounds. Ensembles by emcee's autocorrelation time, no-U-turn chains by ArviZ.",
                (2, 3, 4),
            ),
            Paragraph(
                "With its default settings, which stop at 1,000 effective samples in bulk and tails and at"
                f" convergence, the sampler takes {format_duration(found.default_seconds)} for"
                f" {format_number(found.default_ess, 2)} effective samples in the bulk and"
                f" {format_number(found.default_tail_ess, 2)} in the tails. Its proposals lie opposite to the"
                " walker, which serves means more than tails."
            ),
        ),
    )


def _scaling(found: Performance) -> Section:
    return Section("How it scales", (scaling_figure(found.by_parameters, found.by_samples),))


def _hard(found: Performance) -> Section:
    rows = tuple(
        (
            case.name,
            format_number(case.effective_samples_per_second, 2),
            format_duration(case.seconds),
            "yes" if case.converged else "NO",
            f"{case.largest_z:.1f} (of {case.comparisons})",
        )
        for case in found.hard
    )
    return Section(
        "Posteriors that are not the twin's",
        (
            Table(
                ("posterior", "effective samples a second", "CPU time", "converged", "largest z"),
                rows,
                "The largest difference between the sampler's means and variances and those of a long run of"
                " differential evolution alone, in standard errors of both. Among so many comparisons"
                " 3 is no surprise. Differential evolution starts from the sampler's own draws and does not"
                " change the weights of far modes: there it checks the shape of each.",
                (1, 2, 4),
            ),
        ),
    )


def _orders(found: Performance) -> Section:
    rows = tuple(
        (
            f"AR({row.order})" + (" (true)" if row.order == found.true_order else ""),
            str(row.replicates),
            format_percent(row.coverage50, 1),
            format_percent(row.coverage94, 1),
            f"{row.not_white} of {row.replicates}",
        )
        for row in found.orders
    )
    blocks: list[Block] = [
        Table(
            ("assumed noise", "replicates", "50 % intervals hold", "94 % intervals hold", "named not white"),
            rows,
            "Coverage of the intervals of the axis's parameters, pooled, and replicates in which the residual"
            " test finds correlation left in time.",
            (1, 2, 3),
        ),
        Bullets(
            (
                "An order that is too low counts correlated samples as if each brought new information: the"
                " intervals are too narrow, and the residual test says so.",
            )
        ),
    ]
    return Section("An AR order that is too low", tuple(blocks))


def _times(ratio: float) -> str:
    return f"{format_number(ratio, 3)} times"
