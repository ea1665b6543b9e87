"""Sphinx's configuration of the site. tools/docs/build lays out what it reads."""

import logging
import os

project = "qjulia"
author = "the developers of qjulia"
release = os.environ["QJULIA_VERSION"]
version = release

extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "docs/README"
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["examples"]

myst_heading_anchors = 4
suppress_warnings = ["myst.header"]

breathe_projects = {"qjulia": os.environ["QJULIA_DOXYGEN"]}
breathe_default_project = "qjulia"
breathe_show_include = False

autodoc_member_order = "groupwise"
autodoc_typehints = "none"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
default_role = "code"

html_theme = "furo"
html_title = f"qjulia {release}"
html_show_sourcelink = False
html_copy_source = False
html_static_path = []


def is_news(record):
    """Whether a warning is more than that headers share a namespace, or that a default value is a lambda."""
    text = record.getMessage()
    if text.startswith("Duplicate C++ declaration"):
        return not text.rstrip().endswith("'.. cpp:type:: qjulia'.")
    return not text.startswith("Parsing of expression failed. Using fallback parser.")


def setup(app):
    for handler in logging.getLogger("sphinx").handlers:
        handler.filters.insert(0, is_news)
