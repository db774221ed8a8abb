"""The report of the study of error sources: what each adds to the intervals, and what to the bias."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayes_hw.provenance import Provenance
from bayes_hw.report.page.document import Badge, Bullets, KeyValues, Paragraph, Report, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_number, format_percent
from pages.figures_error_sources import bias_in_half_widths, shares_by_source

REFERENCE = "reference"
NOT_IN_MODEL = "–"
LOST = 0.5
"""A bias beyond this share of the true value means that the parameter stands for something else."""


@dataclass(frozen=True)
class ParameterError:
    """Bias (mean over the replicates of posterior mean less truth) and mean half 94 % interval, in `unit`.

    `misses` counts replicates whose interval does not hold the truth.
    """

    truth: float
    bias: float
    half_width: float
    misses: int
    unit: str

    @property
    def lies(self) -> bool:
        """Whether the bias exceeds half the interval."""
        return abs(self.bias) > self.half_width


@dataclass(frozen=True)
class ErrorSource:
    """One source alone: in how many of its replicates residuals were white and chains converged."""

    name: str
    family: str
    strength: str
    replicates: int
    white: int
    converged: int
    parameters: dict[str, ParameterError]

    @property
    def lying(self) -> tuple[str, ...]:
        """Parameters whose interval lies."""
        return tuple(name for name, error in self.parameters.items() if error.lies)

    @property
    def lost(self) -> tuple[str, ...]:
        """Parameters that lie by more than LOST of the true value."""
        return tuple(
            name
            for name in self.lying
            if abs(self.parameters[name].bias) > LOST * abs(self.parameters[name].truth)
        )


def width_shares(sources: Sequence[ErrorSource], parameter: str) -> dict[str, float]:
    """Share of each source in the sum of what all add to the squared half width of the reference."""
    reference = next(source for source in sources if source.family == REFERENCE).parameters[parameter]
    return _shares(
        {
            source.name: max(source.parameters[parameter].half_width ** 2 - reference.half_width**2, 0.0)
            for source in sources
            if source.family != REFERENCE and parameter in source.parameters
        }
    )


def bias_shares(sources: Sequence[ErrorSource], parameter: str) -> dict[str, float]:
    """Share of each source in the sum of the sizes of all biases."""
    return _shares(
        {
            source.name: abs(source.parameters[parameter].bias)
            for source in sources
            if source.family != REFERENCE and parameter in source.parameters
        }
    )


def error_sources_report(sources: Sequence[ErrorSource], provenance: Provenance) -> Report:
    """The report whose first page shows every bias in units of its interval."""
    names = tuple(sources[0].parameters)
    symbols = {name: parameter_name(name).symbol for name in names}
    others = [source for source in sources if source.family != REFERENCE]
    cells = sum(len(source.parameters) for source in others)
    lying = sum(len(source.lying) for source in others)
    betrayed = [source for source in others if source.lying]
    noticed = [source for source in betrayed if source.white == 0]
    ratios = {
        source.name: {symbols[n]: abs(e.bias) / e.half_width for n, e in source.parameters.items()}
        for source in sources
    }
    families = {source.name: source.family for source in others}
    return Report(
        title="Sources of error",
        subtitle="Nanshan 26 m twin: one error source at a time beside a tenth of the noise",
        verdict=_verdict(others, betrayed, noticed),
        badges=(
            Badge(
                "intervals",
                "warn" if lying else "good",
                f"the bias is larger than half the 94 % interval for {lying} of {cells} pairs of source and"
                " parameter",
            ),
            Badge(
                "noticed",
                "good" if len(noticed) == len(betrayed) else "warn",
                f"residual tests fail in every replicate for {len(noticed)} of {len(betrayed)} sources that"
                " make an interval lie",
            ),
            Badge(
                "converged",
                "good" if all(s.converged == s.replicates for s in sources) else "warn",
                f"{sum(s.converged for s in sources)} of {sum(s.replicates for s in sources)} posteriors",
            ),
        ),
        key_figure=bias_in_half_widths(ratios, tuple(symbols.values())),
        sections=(
            Section(
                "Shares",
                (
                    shares_by_source(
                        {symbols[n]: width_shares(sources, n) for n in names},
                        {symbols[n]: bias_shares(sources, n) for n in names},
                        families,
                    ),
                    _share_table(
                        "Share of what all sources add to the squared interval width.", sources, True
                    ),
                    _share_table("Share of the sum of the sizes of all biases.", sources, False),
                    Paragraph(
                        "Shares hold for the strengths chosen here (next table); they rank sources of these"
                        " strengths, not sources as such."
                    ),
                ),
            ),
            Section(
                "The sources",
                (_source_table(sources), _lost(others), *(_numbers(source) for source in sources)),
            ),
            Section("How it was found", (_method(sources),)),
            Section("Provenance", (KeyValues(provenance.rows()),)),
        ),
    )


def _verdict(
    others: Sequence[ErrorSource], betrayed: Sequence[ErrorSource], noticed: Sequence[ErrorSource]
) -> str:
    if not betrayed:
        return f"None of {len(others)} error sources moves a parameter out of its 94 % interval."
    honest = [source.name for source in others if not source.lying]
    silent = [source.name for source in betrayed if source not in noticed]
    text = (
        f"{len(betrayed)} of {len(others)} error sources move a parameter by more than half its 94 %"
        f" interval, which then lies: {', '.join(source.name for source in betrayed)}."
    )
    if honest:
        text += f" The bias stays within the interval under: {', '.join(honest)}."
    unsure = [source.name for source in others if source.converged < source.replicates]
    if unsure:
        text += f" Chains had not all converged under: {', '.join(unsure)}."
    if silent:
        return f"{text} Residual tests do not always give away: {', '.join(silent)}."
    return f"{text} The residual tests give away every one that lies."


def _lost(others: Sequence[ErrorSource]) -> Paragraph:
    named = [
        f"{', '.join(parameter_name(name).symbol for name in source.lost)} under {source.name}"
        for source in others
        if source.lost
    ]
    share = format_percent(LOST)
    if not named:
        return Paragraph(f"No interval that lies is off by more than {share} of the true value.")
    return Paragraph(
        f"Off by more than {share} of the true value, so that the parameter stands for something else:"
        f" {'; '.join(named)}. Such a parameter also dominates the shares above."
    )


def _source_table(sources: Sequence[ErrorSource]) -> Table:
    return Table(
        ("source", "of what kind", "how strong", "white", "converged", "interval lies for"),
        tuple(
            (
                source.name,
                source.family,
                source.strength,
                f"{source.white} of {source.replicates}",
                f"{source.converged} of {source.replicates}",
                ", ".join(parameter_name(name).symbol for name in source.lying) or "none",
            )
            for source in sources
        ),
        "The sources; of the replicates, those with white residuals and those whose chains converged;"
        " and where the bias exceeds half the interval.",
    )


def _numbers(source: ErrorSource) -> Table:
    return Table(
        ("parameter", "truth", "bias", "half interval", "ratio", "misses"),
        tuple(
            (
                parameter_name(name).words,
                format_number(error.truth, 4, error.unit),
                format_number(error.bias, 2, error.unit),
                format_number(error.half_width, 2, error.unit),
                format_number(abs(error.bias) / error.half_width, 2),
                f"{error.misses} of {source.replicates}",
            )
            for name, error in source.parameters.items()
        ),
        f"{source.name.capitalize()} ({source.strength}): bias and half the 94 % interval; misses are"
        " replicates whose interval does not hold the truth.",
        (1, 2, 3, 4),
    )


def _share_table(caption: str, sources: Sequence[ErrorSource], width: bool) -> Table:
    names = tuple(sources[0].parameters)
    shares = {name: (width_shares if width else bias_shares)(sources, name) for name in names}
    return Table(
        ("source", *(parameter_name(name).symbol for name in names)),
        tuple(
            (
                source.name,
                *(
                    format_percent(shares[name][source.name]) if source.name in shares[name] else NOT_IN_MODEL
                    for name in names
                ),
            )
            for source in sources
            if source.family != REFERENCE
        ),
        caption,
        tuple(range(1, len(names) + 1)),
    )


def _method(sources: Sequence[ErrorSource]) -> Bullets:
    return Bullets(
        (
            "Records and commands are those of the twin's training; every source is drawn"
            f" {sources[0].replicates} times, with noise that all sources share.",
            "Noise, quantization, sampling and structure are sampled with the true other roots of G; for a"
            " lower order all that is left of G is fitted to the records first.",
            "Quantization and sampling act on the angle with its noise. A late or uneven reading takes the"
            " band-limited continuation between the samples.",
            "Bias under noise alone is scatter of the replicates, not a systematic error.",
            "Where a source leaves structured residuals, the noise model grows to absorb them and chains mix"
            " slowly; a posterior that had not converged when its steps were spent is counted above; read"
            " its numbers as rough.",
        )
    )


def _shares(sizes: dict[str, float]) -> dict[str, float]:
    total = sum(sizes.values())
    return {name: size / total if total > 0 else 0.0 for name, size in sizes.items()}
