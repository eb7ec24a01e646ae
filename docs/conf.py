"""How the documentation is built: ``python -m sphinx docs output/docs``, which needs no network."""

import os
import sys
from importlib.metadata import version as version_of
from pathlib import Path

from sphinx.domains.std import StandardDomain

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("COLUMNS", "100")

project = "daebench"
author = "The daebench founders"
copyright = "2026, the daebench founders; BSD 3-Clause"
release = version = version_of("daebench")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "daebench_site",
]
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
exclude_patterns = ["daebench_site", "_static"]
default_role = "code"
suppress_warnings = ["myst.header"]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 900
nb_output_stderr = "warn"
nb_mime_priority_overrides = [("html", "image/svg+xml", 5)]

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = False
maximum_signature_line_length = 88
add_module_names = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
pygments_style, pygments_dark_style = "tango", "github-dark"
html_title = f"daebench {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
StandardDomain.object_types["term"].attrs["searchprio"] = 0  # a term of the glossary is the first hit of its word
html_search_scorer = str(Path(__file__).parent / "_static" / "scorer.js")
html_copy_source = False
html_show_sphinx = False
smartquotes = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f5fa8", "color-brand-content": "#1f5fa8"},
    "dark_css_variables": {"color-brand-primary": "#86b7ec", "color-brand-content": "#86b7ec"},
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
