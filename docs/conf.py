"""Configuration of the documentation site for Sphinx; `python -m docs.site` builds it."""

from __future__ import annotations

import re
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

# Sphinx executes this file by its path, so that the package of this folder is not on the path.
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from docs import generated_pages
from draft.extras import own_version

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "Draft"
author = "The Draft developers"
project_copyright = author
release = version = own_version()

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["**/__pycache__"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
# Documents mix Python with sessions at its prompt; both are shown as they are.
highlight_language = "text"
suppress_warnings = ["misc.highlighting_failure"]

default_role = "literal"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
# "Attributes:" sections become fields: properties are documented once, where they are defined.
napoleon_use_ivar = True
napoleon_attr_annotations = False
napoleon_numpy_docstring = False
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = "Draft"
html_show_sourcelink = False
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]


def _mark_code(*given: object) -> None:
    """Mark indented code below a sentence of a docstring, which reStructuredText needs as `::`."""
    lines = given[-1]
    assert isinstance(lines, list)
    for row, line in enumerate(lines[:-2]):
        sentence = re.match(r"\S+ .*[^:]:$", line) is not None
        if sentence and not lines[row + 1] and lines[row + 2].startswith("    "):
            lines[row] = f"{line}:"


def setup(app: Sphinx) -> None:
    """Write the pages that follow from the code before Sphinx reads the folder."""
    # Libraries that autodoc imports may warn; only Sphinx's own warnings fail the build.
    warnings.simplefilter("ignore")
    app.connect("autodoc-process-docstring", _mark_code, priority=100)
    app.connect("builder-inited", lambda _: generated_pages.write_all())
