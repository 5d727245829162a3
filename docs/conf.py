"""Sphinx: the documentation site, ``make site``.

Nothing of a page is fetched from elsewhere: mathematics is MathML, search runs in the page.
"""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path

from numpydoc import xref

import armimpedance

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE / "_site"))
# Pages are kept until they are written; to look through them for garbage took a tenth of the time.
gc.set_threshold(200_000, 20, 100)
# Tutorials call `armimpedance` as a reader would; one thread each, for two run side by side.
os.environ["PATH"] = f"{Path(armimpedance.__file__).parents[1] / '.venv/bin'}:{os.environ['PATH']}"
os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "COLUMNS": "80"}

# Names of other packages are shown as they are written.
xref.DEFAULT_LINKS.clear()

project = "armimpedance"
author = "The armimpedance developers"
copyright = author  # noqa: A001 - Sphinx's name
version = release = armimpedance.__version__

extensions = [
    "sphinx.ext.autodoc",
    "numpydoc",
    "myst_nb",
    "sphinx_design",
    "sphinx_copybutton",
    "mathml",
    "written_pages",
    "picture_grid",
    "accessible",
    "seconds",
]
exclude_patterns = ["README.md", "_site", "_static", "**/.ipynb_checkpoints", "jupyter_execute"]
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
language = "en"

# Internal links are checked one and all; types of other packages have no page here.
nitpicky = True
# Pages on the code host go from the title to small headings, which are read in their order.
suppress_warnings = ["myst.header"]
nitpick_ignore_regex = [
    ("py:.*", r"(?!armimpedance\.).*"),
    ("ref|term", r"python:.*"),
    ("ref|term", r"numpy:.*"),
]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
myst_links_external_new_tab = False

nb_execution_mode = "force"
# A machine may be busy: each tutorial takes some 10 to 20 s of its own.
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_execution_in_temp = True
nb_merge_streams = True

autodoc_typehints = "none"
autodoc_member_order = "bysource"
python_maximum_signature_line_length = 88
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = {name: f"armimpedance.{name}" for name in armimpedance.__all__}

html_theme = "pydata_sphinx_theme"
html_title = "armimpedance"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_search_scorer = str(HERE / "_static" / "scorer.js")
html_show_sourcelink = False
html_copy_source = False
html_sidebars = {"index": [], "gallery": []}
html_theme_options = {
    "logo": {"text": "armimpedance"},
    "header_links_before_dropdown": 7,
    "navbar_align": "left",
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
