"""Sphinx configuration: `python -m sphinx -W --keep-going docs docs/_build` builds the site.

`-D plot_gallery=0` leaves out the run of the examples, and with it their pictures.
"""

from __future__ import annotations

import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "_ext"))

import example_gallery  # noqa: E402

from stiffness_model.version import __version__  # noqa: E402

project = "reefmu"
author = "the reefmu authors"
copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "program_commands",
    "fmu_variables",
    "effect_pages",
    "live_drive",
    "public_names",
]
exclude_patterns = ["_build", "_ext", "gallery/*.ipynb", "gallery/*.py", "**/GALLERY_HEADER.rst"]
nitpicky = True
nitpick_ignore_regex = [
    # Types of other projects, whose inventories would need a network.
    ("py:.*", r"(np|numpy|casadi|ca|control|matplotlib|pathlib|collections|concurrent|typing|pandas|Figure|Axes)\b.*"),
    # Annotations as they stand in the sources: aliases of types, and classes of modules that have no page.
    ("py:class", r".*"),
]

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4
smartquotes = False  # they would turn the two hyphens of an option into a dash

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "Controller", "Progress", "Scheme")}
python_maximum_signature_line_length = 88

html_theme = "furo"
html_title = f"reefmu {version.partition('+')[0]}"  # without the commit
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("tables.js", {"defer": "defer"})]
html_show_copyright = False
html_copy_source = False
pygments_style = "tango"
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_exclude = ".linenos, .gp, .go, .remark"

sphinx_gallery_conf = example_gallery.configuration(DOCS)
suppress_warnings = ["config.cache"]
