"""The documentation as a website: `make docs` builds docs/_build/html, strictly."""

from __future__ import annotations

import sys
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

from identify import __version__  # noqa: E402

project = "identify"
author = "The identify developers"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx-mathjax-offline"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build", "notebooks"]
suppress_warnings = ["myst.header"]
html_theme = "furo"
html_title = f"identify {__version__}"
html_show_sphinx = False
html_copy_source = False


def setup(app: Sphinx) -> None:
    """Write the reference from the code before anything is read."""
    from reference_pages import write_reference  # noqa: PLC0415

    app.connect("builder-inited", lambda app: write_reference(Path(app.srcdir)))
