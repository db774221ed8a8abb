"""What holds of every report page in a browser."""

from __future__ import annotations

from browser import Browser

NOT_DRAWN = """
[...document.querySelectorAll("figure, .formula")]
  .map(shown => [shown.id, ...shown.querySelectorAll("img, canvas, table")].map(one => {
    if (typeof one === "string") return "";
    if (one.checkVisibility && !one.checkVisibility()) return "";
    const box = one.getBoundingClientRect();
    const empty = box.width < 10 || box.height < 5 || (one.tagName === "IMG" && !one.naturalWidth);
    return empty ? one.tagName + " of " + shown.id : "";
  }).filter(Boolean))
  .flat()
"""
"""Pictures, canvases and tables meant to be seen that take up no room."""

HIDDEN_FIGURES = """
[...document.querySelectorAll("figure")]
  .filter(figure => ![...figure.querySelectorAll("img, canvas, table")].some(one => one.checkVisibility()))
  .map(figure => figure.id)
"""

DEAD_LINKS = """
[...document.querySelectorAll("a[href^='#']")]
  .map(link => link.hash.slice(1)).filter(name => !document.getElementById(name))
"""


def check_page(browser: Browser) -> None:
    """What holds of every page, once opened."""
    browser.evaluate("document.querySelectorAll('details').forEach(folded => { folded.open = true; })")
    assert browser.errors == []
    assert len(browser.requests) == 1
    assert browser.evaluate(NOT_DRAWN) == []
    assert browser.evaluate(HIDDEN_FIGURES) == []
    assert browser.evaluate(DEAD_LINKS) == []
