import xml.etree.ElementTree as ElementTree

import pytest

from bayes_hw.report.page import equations
from bayes_hw.report.page.document import Formula
from bayes_hw.report.page.render import formula_svg

FORMULAS = {name: found for name, found in vars(equations).items() if isinstance(found, Formula)}


@pytest.mark.parametrize("name", FORMULAS)
def test_every_formula_typesets_and_has_a_reading(name):
    svg = formula_svg(FORMULAS[name].typst)
    root = ElementTree.fromstring(svg)
    glyphs = [element for element in root.iter() if element.tag.endswith("}use")]
    assert len(glyphs) >= 8
    assert len(FORMULAS[name].words.split()) >= 8
