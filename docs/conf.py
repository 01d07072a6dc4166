"""Sphinx builds these pages as a site: ``kendama docs``, or ``sphinx-build -W docs site`` with the extra ``docs``."""

import sys
from pathlib import Path

import kendama_cli

sys.path.insert(0, str(Path(__file__).parent))

project = "kendama"
project_copyright = "the kendama contributors"
author = "The kendama developers"
release = version = kendama_cli.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "declared", "mathml"]
exclude_patterns = ["README.md", "site"]  # a release has the built site there
myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "mathml"
highlight_language = "none"  # indented blocks are command lines, equations and tables of text
autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_type_aliases = {"Array": "Array", "ArrayLike": "ArrayLike"}  # not the unions that numpy makes of them
add_module_names = False
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["tables.css"]
html_title = f"kendama {release}"
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f5f8b", "color-brand-content": "#1f5f8b"},
    "dark_css_variables": {"color-brand-primary": "#7ab8e0", "color-brand-content": "#7ab8e0"},
}
