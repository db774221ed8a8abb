import xml.etree.ElementTree as ElementTree

import pytest

from bayes_hw.report.page.equations import CATALOGUE
from bayes_hw.report.page.pdf import formula_svg


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_formula_typesets_and_has_a_reading(name):
    svg = formula_svg(CATALOGUE[name].typst)
    root = ElementTree.fromstring(svg)
    glyphs = [element for element in root.iter() if element.tag.endswith("}use")]
    assert len(glyphs) >= 8
    assert len(CATALOGUE[name].words.split()) >= 8
