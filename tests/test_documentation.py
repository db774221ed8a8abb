"""The README and the pages: short, true to the catalogue, links that lead somewhere, numbers that exist."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from bayes_hw.gap.effects.descriptions import DESCRIPTIONS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PAGES += [p for p in DOCS.rglob("*.md") if not {"_build", "generated"} & set(p.parts)]


def test_the_readme_is_short_and_names_every_effect_as_the_gallery_does() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    assert dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", text, re.MULTILINE)) == {
        label: one.meaning for label, one in DESCRIPTIONS.items()
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    """Relative ones; what is generated while the pages are built is left to that."""
    text = page.read_text(encoding="utf-8")
    targets = [target for target in re.findall(r"\]\(([^)#\s]+)", text) if "://" not in target]
    for target in targets:
        if "generated/" not in target:
            assert (page.parent / target).exists(), target


def test_numbers_of_the_pages_are_in_the_results(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sphinx", reason="the packages of the documentation are not installed")
    monkeypatch.syspath_prepend(str(DOCS / "extensions"))
    numbers = __import__("study_numbers")
    text = (DOCS / "validation.md").read_text(encoding="utf-8")
    found = re.findall(r"\{(rate|number)\}`([^`]+)`", text)
    assert len(found) > 50
    for role, given in found:
        study, _, path = given.partition(":")
        if role == "rate":
            hits, trials = numbers.counted(study, path)
            assert 0 <= hits <= trials
        else:
            value = numbers.looked_up(study, path.partition(";")[0])
            assert value is None or isinstance(value, int | float)
    with pytest.raises(numbers.MissingNumberError, match="no such key"):
        numbers.looked_up("08_blind_check", "easy/no such key")
    sys.modules.pop("study_numbers")


@pytest.mark.parametrize(
    ("hits", "trials", "said"),
    [(9, 10, "9 of 10, 90 % [55, 100]"), (267, 268, "267 of 268, 99.6 % [98, 100]"), (0, 0, "none tried")],
)
def test_shares_are_not_rounded_to_certainty(
    monkeypatch: pytest.MonkeyPatch, hits: int, trials: int, said: str
) -> None:
    pytest.importorskip("sphinx", reason="the packages of the documentation are not installed")
    monkeypatch.syspath_prepend(str(DOCS / "extensions"))
    assert __import__("study_numbers").percent(hits, trials) == said
    sys.modules.pop("study_numbers")
