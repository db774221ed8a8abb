import pytest

from bayes_hw.report.page.names import parameter_name, setting_unit, setting_words


@pytest.mark.parametrize(
    ("name", "words", "symbol"),
    [
        ("saturation.lower", "lower saturation limit", "s₋"),
        ("mode1.frequency_hz", "frequency of mode 1", "f₁"),
        ("mode12.damping_ratio", "damping ratio of mode 12", "ζ₁₂"),
        ("noise.autoregression2", "noise AR coefficient 2", "φ₂"),
        ("start2.pair1.cosine", "free response of pair 1 (cosine), record 2", "A₁,₂"),
        ("something.else", "something.else", "something.else"),
    ],
)
def test_names_read_as_words_and_symbols(name, words, symbol):
    assert parameter_name(name) == (words, symbol)


@pytest.mark.parametrize(
    ("name", "words", "unit"),
    [
        ("stop_hz", "stop", "Hz"),
        ("hold_s", "hold", "s"),
        ("deviation_rad", "deviation", "rad"),
        ("top_level", "top level", "deg/s"),
        ("rms", "rms", "deg/s"),
        ("offset_share", "offset share", ""),
        ("depth", "depth", ""),
    ],
)
def test_settings_of_commands_have_their_units(name: str, words: str, unit: str) -> None:
    assert (setting_words(name), setting_unit(name, "deg/s")) == (words, unit)
