"""Sphinx configuration: MyST pages, furo, and what is made from the code at build time."""

from __future__ import annotations

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE.parent)]
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HERE.parent), os.environ.get("PYTHONPATH")]))

import bayes_hw  # noqa: E402

project = "bayes_hw"
author = "The bayes_hw developers"
project_copyright = author
version = release = bayes_hw.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.doctest",
    "effect_gallery",
    "architecture_diagram",
    "constants_page",
    "command_pages",
    "schema_pages",
    "study_numbers",
    "shell_session",
]

html_theme = "furo"
html_title = f"bayes_hw {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_theme_options = {"source_directory": "docs/"}
html_show_sourcelink = False
html_copy_source = False

exclude_patterns = ["_build", "extensions"]
nitpicky = False
myst_enable_extensions = ["colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 3
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
doctest_test_doctest_blocks = ""
doctest_global_setup = f"""
import os, tempfile
HOW_TO = {str(HERE / "how-to")!r}
os.chdir(tempfile.mkdtemp())
"""
suppress_warnings = ["config.cache"]
