"""What a notebook shows of an answer."""

from __future__ import annotations

import html
from collections.abc import Sequence

import pandas as pd


def table_with_words(table: pd.DataFrame, words: str, notes: Sequence[str] = ()) -> str:
    """HTML of a sentence, a table and notes below it; nothing in them is taken for a tag."""
    below = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    shown = table.to_html(float_format=lambda value: f"{value:.5g}")
    return f"<p>{html.escape(words)}</p>{shown}<ul>{below}</ul>"
