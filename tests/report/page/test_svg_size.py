"""The smaller SVG shows the same: every vertex arrives within a twentieth of a point."""

import re

import numpy as np

from bayes_hw.report.page.svg_size import LONG_PATH, compact


def vertices(data):
    """Absolute vertices of the path that `compact` writes for polylines."""
    found = []
    for begin, steps in re.findall(r"M([^lzM]*)(?:l([^zM]*))?", data):
        numbers = r"-?(?:\d+\.?\d*|\.\d+)"
        at = np.array(re.findall(numbers, begin), dtype=float)
        found.append(at)
        for step in np.array(re.findall(numbers, steps), dtype=float).reshape(-1, 2):
            at = at + step
            found.append(at)
    return np.array(found)


def test_long_polylines_keep_their_vertices():
    points = np.cumsum(np.random.default_rng(1).normal(size=(500, 2)), axis=0)
    data = "M " + " L ".join(f"{x:.6f} {y:.6f}" for x, y in points) + " \n"
    assert len(data) > LONG_PATH
    written = re.search(r' d="([^"]*)"', compact(f'<svg><path d="{data}"/></svg>'))[1]
    assert len(written) < 0.5 * len(data)
    shown = vertices(written)
    distance = np.abs(points[:, None] - shown).max(axis=2).min(axis=1)
    assert distance.max() <= 0.0501
    assert np.abs(shown[-1] - points[-1]).max() <= 0.0501


def test_several_closed_polylines_stay_apart():
    part = " ".join(f"L {k}.25 {k}.75" for k in range(1, 40))
    data = f"M 0.5 0.5 {part} z M 100.5 100.5 {part} z"
    written = re.search(r' d="([^"]*)"', compact(f'<path d="{data}"/>'))[1]
    assert written.count("M") == written.count("z") == 2
    assert [100.5, 100.5] in vertices(written).tolist()


def test_curves_and_names_in_use_are_kept():
    curve = "M 1.23456 2 " + " ".join("Q 1.5 2.5 3.5 4.5" for _ in range(40))
    svg = compact(
        f'<!-- a --><g id="axes_1">\n <path id="p1" d="{curve}" style="fill: none; stroke: #000"/></g>'
    )
    assert svg.startswith('<g><path id="p1" d="M1.23 2Q1.5 2.5')
    assert svg.count("Q") == 40
    assert 'style="fill:none;stroke:#000"' in svg
