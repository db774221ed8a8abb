import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.report.page.typography import HIDDEN_CATEGORIES, visible


def test_ordinary_text_is_left_as_it_is():
    text = "Nanshan 26 m, δ = 0.012°, 南山, naïve <b> $x$ #f \\ @a ../b"
    assert visible(text) == text


def test_hidden_characters_are_written_as_their_code():
    assert visible("a\x00b\x1b\u202ec\u200f\ud800") == "a‹U+0000›b‹U+001B›‹U+202E›c‹U+200F›‹U+D800›"


def test_white_space_stays_on_one_line():
    assert visible("a\nb\tc\r\nd\u2028e") == "a b c  d e"


@given(st.text(alphabet=st.characters(exclude_categories=())))
def test_result_shows_in_full_and_encodes(text):
    shown = visible(text)
    assert not any(unicodedata.category(character) in HIDDEN_CATEGORIES for character in shown)
    assert visible(shown) == shown
    shown.encode("utf-8")
