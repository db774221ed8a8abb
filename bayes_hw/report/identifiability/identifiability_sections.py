"""Sections on structure, ridge, assumptions, spectrum and profiles."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.identifiability.analysis import Identifiability
from bayes_hw.identifiability.asymmetry import PRIOR_LOG_SDS, REFERENCE_LOG_SD, SUBSTANTIAL
from bayes_hw.identifiability.freed_gains import (
    GAIN,
    GAIN_POSITIVE,
    HALF_WIDTH_POSITIVE,
    LOWER,
    SLOPE,
    UPPER,
)
from bayes_hw.identifiability.invariance import orbit_through
from bayes_hw.identifiability.profile import THRESHOLD, Profile
from bayes_hw.identifiability.scaling_group import log_monomial
from bayes_hw.identifiability.structure import FLAT_BELOW, SMALLEST_GAP
from bayes_hw.identify.output_error import prior_scale
from bayes_hw.model.parameters import as_coordinates
from bayes_hw.model.priors import LogNormal
from bayes_hw.report.identifiability.figures_identifiability import (
    ContractionRow,
    RatioPanel,
    RidgePanel,
    SpectrumPanel,
    contraction_bars,
    ratios,
    ridge,
    spectra,
)
from bayes_hw.report.identifiability.figures_profile import ProfilePanel, nuisance_paths, profiles
from bayes_hw.report.page import equations
from bayes_hw.report.page.document import Block, Bullets, Equation, Figure, Paragraph, Section, Table
from bayes_hw.report.page.names import parameter_name
from bayes_hw.report.page.rounding import format_estimate, format_interval, format_number
from bayes_hw.report.page.typography import MINUS

SETTING_WORDS = {
    "c1 = 1": "c₁ = 1",
    "c2 = 1": "c₂ = 1",
    "c3 = c2": "c₃ = c₂",
    "delta- = delta+": "δ₋ = δ₊",
}
ORBIT_REACH = 3.0
"""Half length of a drawn orbit, as a logarithm."""

RIDGE_PAIRS = (
    (SLOPE, UPPER, "upper/c1", 0),
    (SLOPE, LOWER, "lower/c1", 0),
    (GAIN_POSITIVE, HALF_WIDTH_POSITIVE, "c2 delta+", 1),
)


def ridge_figure(result: Identifiability) -> Figure:
    """Four pairs of raw parameters on their ridges."""
    return ridge([*(_ridge_panel(result, *pair) for pair in RIDGE_PAIRS), _gain_panel(result)])


def _ridge_panel(result: Identifiability, first: str, second: str, known: str, generator: int) -> RidgePanel:
    freed = result.freed
    orbit = orbit_through(freed, np.linspace(-ORBIT_REACH, ORBIT_REACH, 50), generator)
    columns = [freed.axis.names.index(name) for name in (first, second)]
    priors = [freed.axis.parameters[column].prior.of_logarithm for column in columns]
    return RidgePanel(
        _axis_label(result, first),
        _axis_label(result, second),
        np.log10(np.abs(freed.chains(first).ravel())),
        np.log10(np.abs(freed.chains(second).ravel())),
        np.log10(np.abs(orbit[:, columns])),
        np.array([prior[0] for prior in priors if prior is not None]) / np.log(10),
        np.array([prior[1] for prior in priors if prior is not None]) / np.log(10),
        parameter_name(known).symbol,
    )


def _gain_panel(result: Identifiability) -> RidgePanel:
    """The gain of G against c1 c2: both generators move along one line."""
    freed = result.freed
    product = {SLOPE: 1.0, GAIN_POSITIVE: 1.0}
    gain, known = ({GAIN: 1.0}, {SLOPE: 1.0, GAIN: 1.0, GAIN_POSITIVE: 1.0})
    x, y = (log_monomial(each, freed.values, freed.names).ravel() / np.log(10) for each in (product, gain))
    middle = float(np.mean(log_monomial(known, freed.values, freed.names))) / np.log(10)
    along = np.linspace(-2, 2, 50)
    prior = {p.name: p.prior.of_logarithm or (0.0, 0.0) for p in freed.axis.parameters}
    sd = [np.hypot(prior[SLOPE][1], prior[GAIN_POSITIVE][1]), prior[GAIN][1]]
    return RidgePanel(
        "c₁ c₂",
        _axis_label(result, GAIN),
        x,
        y,
        np.column_stack([along, middle - along]),
        np.array([0.0, prior[GAIN][0] / np.log(10)]),
        np.array(sd) / np.log(10),
        "c₁ g c₂",
    )


def _axis_label(result: Identifiability, name: str) -> str:
    parameter = result.freed.axis.parameters[result.freed.axis.names.index(name)]
    sign = "−" if parameter.nominal < 0 else ""
    words = f"{sign}{_symbol(name)}"
    return f"{words} ({parameter.unit})" if parameter.unit else words


def structure_section(result: Identifiability) -> Section:
    """Flat directions, invariants, and which settings are normalizations."""
    s = result.structure
    settings = tuple(
        (
            SETTING_WORDS[setting.name],
            str(setting.rank_before),
            str(setting.rank_after),
            "normalization: costs nothing" if setting.normalization else "assumption: data can contradict it",
        )
        for setting in s.settings
    )
    agrees = "exactly as many" if s.agrees else "NOT as many"
    return Section(
        "Structure: what no experiment can tell",
        (
            Equation(
                equations.SCALING_GROUP,
                "The rescaling of v by a and of w by b that changes no output, whatever the record.",
            ),
            Paragraph(
                f"At {len(s.flat)} points drawn about the model, {len(s.names)} parameters were moved one "
                "by one and the output differentiated, on a command that reaches both limits and crosses "
                "the dead zone. A singular value of that sensitivity matrix counts as flat below "
                f"{format_number(FLAT_BELOW, 1)} of the largest, and the next one must be {SMALLEST_GAP:g} "
                f"times as large as the largest flat one. Found: {_counts(s.flat)} flat directions, "
                f"{agrees} as the scaling group has dimensions ({s.expected}); smallest gap "
                f"{format_number(float(s.gap.min()), 2)}, largest principal angle between the null space "
                f"and the group {format_number(float(s.angle.max()), 2)} rad. Finite steps along the group, "
                "by factors of several, changed the output by at most "
                f"{format_number(float(s.orbit_error.max()), 1)} of its size: rounding. {s.redrawn} further "
                "points were drawn again because a regime was missing or a sample stood within a "
                "difference step of a limit."
            ),
            Table(
                ("setting", "rank without", "rank with", "what it is"),
                settings,
                "The paper's settings one after the other, and the rank of what the data can see "
                "(directions with a singular value that is not flat). A setting that leaves the rank as it "
                "was takes nothing away.",
                (1, 2),
            ),
            Paragraph(
                "What input and output can tell of limits, gains and thresholds, the invariants of the group:"
            ),
            Bullets(
                tuple(
                    f"{parameter_name(row.invariant.name).symbol}: {parameter_name(row.invariant.name).words}"
                    for row in result.agreement.rows
                )
            ),
        ),
    )


def _counts(flat: IntArray) -> str:
    return " or ".join(str(count) for count in sorted(set(flat.tolist())))


def ridge_section(result: Identifiability) -> Section:
    """Contraction, and the invariants in both runs."""
    rows = [
        ContractionRow(_symbol(c.name), c.contraction, c.by_pooling)
        for c in (*result.raw_contractions, *result.invariant_contractions)
    ]
    table = tuple(
        (
            parameter_name(row.invariant.name).symbol,
            format_estimate(row.freed.mean, row.freed.sd, row.freed.unit),
            format_estimate(row.chart.mean, row.chart.sd, row.chart.unit),
            _signed(row.mean_score),
            _signed(row.sd_score),
        )
        for row in result.agreement.rows
    )
    agreement = result.agreement
    return Section(
        "The posterior with the gains freed",
        (
            Paragraph(
                "All of c₁, c₂, c₃, g, both limits and both thresholds were sampled under weak log-normal "
                "priors (factors of four to seven either way). The first figure shows the ridge that this "
                "leaves. A raw parameter's contraction is no sign of information: priors pooled along the "
                "orbit give as much."
            ),
            contraction_bars(rows),
            Table(
                (
                    "quantity",
                    "prior sd of log",
                    "posterior sd of log",
                    "contraction",
                    "from pooled priors alone",
                ),
                tuple(
                    (
                        _symbol(c.name),
                        format_number(c.prior_log_sd, 2),
                        format_number(c.posterior_log_sd, 2),
                        f"{c.contraction:.4f}",
                        "" if c.by_pooling is None else f"{c.by_pooling:.4f}",
                    )
                    for c in (*result.raw_contractions, *result.invariant_contractions)
                ),
                "Contraction, one less the ratio of posterior to prior variance, of the logarithms.",
                (1, 2, 3, 4),
            ),
            Table(
                ("invariant", "all gains free", "c₁ = c₂ = 1", "mean differs by", "sd differs by"),
                table,
                "Posterior mean ± sd of the invariants in the run with all gains free and in the "
                "normalized run under the prior that the first implies, with the differences of mean and "
                "sd of the logarithm in Monte Carlo standard errors. Chance alone stays below "
                f"{agreement.limit:.1f} in 99 of 100 such tables; the largest here is "
                f"{agreement.largest:.1f}. The normalization has cost nothing.",
                (1, 2, 3, 4),
            ),
        ),
    )


def assumption_section(result: Identifiability) -> Section:
    """The two ratios that the paper sets to one."""
    panels, rows = [], []
    for test in result.assumptions:
        name = parameter_name(test.name)
        exponents = next(
            r.invariant.exponents for r in result.agreement.rows if r.invariant.name == test.name
        )
        draws = np.exp(log_monomial(exponents, result.freed.values, result.freed.names)).ravel()
        panels.append(
            RatioPanel(
                f"{name.words} {name.symbol}",
                draws,
                lambda x: np.exp(LogNormal(1.0, REFERENCE_LOG_SD).log_density(x)),
                test.ratio.hdi94,
                format_interval(*test.ratio.hdi94),
            )
        )
        rows.append(
            (
                name.symbol,
                format_estimate(test.ratio.mean, test.ratio.sd),
                format_interval(*test.ratio.hdi94),
                *(_factor(test.log10_bayes_factor[width]) for width in PRIOR_LOG_SDS),
                test.decision + (" *" if test.extrapolated else ""),
            )
        )
    note = " * the value one lies so far out that the density there is that of a normal fit to the draws."
    return Section(
        "The assumptions tested",
        (
            ratios(panels, f"prior of log sd {REFERENCE_LOG_SD:g}"),
            Table(
                (
                    "ratio",
                    "posterior",
                    "94 % HDI",
                    *(f"log₁₀ BF, sd {width:g}" for width in PRIOR_LOG_SDS),
                    "equality",
                ),
                tuple(rows),
                "Savage-Dickey density ratios: log₁₀ of the Bayes factor for the ratio being one, with "
                "Monte Carlo standard errors, under normal priors of its logarithm with three standard "
                f"deviations. Positive values speak for equality; the one for {REFERENCE_LOG_SD:g} decides, "
                f"beyond ±{np.log10(SUBSTANTIAL):g} (substantial on Jeffreys' scale)."
                + (note if any(test.extrapolated for test in result.assumptions) else ""),
                (1, 2, 3, 4, 5),
            ),
        ),
    )


def _factor(value: tuple[float, float]) -> str:
    return f"{_signed(value[0], 2)} ± {value[1]:.2f}"


def _signed(value: float, decimals: int = 1) -> str:
    return f"{value:+.{decimals}f}".replace("-", MINUS)


def _symbol(name: str) -> str:
    """The symbol of a parameter beside a negative threshold of its own."""
    return "δ₊" if name == HALF_WIDTH_POSITIVE else parameter_name(name).symbol


def spectrum_section(result: Identifiability) -> Section:
    """The Fisher spectrum, and what its weak directions are made of."""
    flats = (result.structure.expected, 0, 0)
    weak = tuple(
        (
            spectrum.label,
            format_number(float(spectrum.eigenvalues[i]), 2),
            ", ".join(f"{_symbol(name)} {_signed(part, 2)}" for name, part in spectrum.components(i)),
        )
        for spectrum in result.spectra
        for i in range(len(spectrum.eigenvalues))
        if spectrum.eigenvalues[i] < 1
    )
    blocks: list[Block] = [
        spectra(
            [
                SpectrumPanel(spectrum.label, spectrum.eigenvalues, flat)
                for spectrum, flat in zip(result.spectra, flats, strict=True)
            ]
        )
    ]
    if weak:
        blocks.append(
            Table(
                ("parametrisation", "information", "direction"),
                weak,
                "Directions that the prior knows better than the records (information below one prior "
                "precision), with their components of 0.3 and more in scaled coordinates.",
                (1,),
            )
        )
    return Section("Fisher spectrum", tuple(blocks))


def profile_section(result: Identifiability) -> Section:
    """Profiles and nuisance paths."""
    panels = [_profile_panel(result, profile) for profile in result.profiles]
    rows = []
    for profile in result.profiles:
        low, high = profile.interval()
        rows.append(
            (
                parameter_name(profile.name).words,
                profile.lower,
                profile.upper,
                format_interval(
                    -np.inf if low is None else low, np.inf if high is None else high, profile.unit
                ),
                ", ".join(sorted({parameter_name(n).symbol for names in profile.at_bound for n in names}))
                or "none",
            )
        )
    return Section(
        "Profile likelihoods",
        (
            profiles(panels, THRESHOLD),
            nuisance_paths(panels),
            Table(
                ("parameter", "below", "above", "95 % interval without prior", "others at a bound"),
                tuple(rows),
                "What each profile does on either side, and where the likelihood alone bounds the "
                "parameter; an open side has no end.",
                (3,),
            ),
        ),
    )


def _profile_panel(result: Identifiability, profile: Profile) -> ProfilePanel:
    axis = next(
        run.axis for run in (result.inference.posterior, result.chart) if run.axis.names == profile.names
    )
    _, prior_sd = prior_scale(axis)
    at: FloatArray = as_coordinates(axis.parameters, profile.nuisance.T)
    estimate = int(np.argmin(np.abs(profile.values - profile.estimate)))
    moved = ((at - at[:, [estimate]]) / prior_sd[:, None]).T
    others = [
        i for i, name in enumerate(profile.names) if name != profile.name and not name.startswith("start")
    ]
    sides = [side for side in (profile.lower, profile.upper) if side == "open"]
    name = parameter_name(profile.name)
    return ProfilePanel(
        name.words,
        profile.unit,
        profile.values,
        profile.log_likelihood,
        moved[:, others],
        tuple(parameter_name(profile.names[i]).symbol for i in others),
        np.array([float(bool(names)) for names in profile.at_bound]),
        profile.estimate,
        " ".join(sides),
    )
