"""Sphinx: `make docs` builds the site into out/docs; it works from disk and asks no network."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import tomllib
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_ext")]

from reports import arithmetic  # noqa: E402 - needs the path

arithmetic.settle()  # commands run in this process, notebooks in those that it starts
# The notebooks run in processes of their own, which must find the folder examples too.
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HERE.parent), os.environ.get("PYTHONPATH")]))

_project = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
project = "actuator-lti"
version = release = _project["version"]
project_copyright = "the authors; MIT license"

extensions = ["myst_nb", "numpydoc", "sphinx.ext.autosummary", "run_code", "generated_pages"]
exclude_patterns = ["_ext", "_templates"]
templates_path = ["_templates"]
default_role = "literal"
highlight_language = "text"
myst_heading_anchors = 3
# Tutorials with figures are notebooks, run anew at each build in a folder that is gone afterwards. Pages
# whose point is a command and its exit status use the directives of run_code, which check that status.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_execution_show_tb = True
nb_merge_streams = True
# The notebooks' kernels live on this machine for a minute; their word on encryption says nothing of a page.
_kernels = Path(tempfile.mkdtemp(prefix="docs-kernels-")) / "profile_default"
_kernels.mkdir()
(_kernels / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 'ERROR'\n", encoding="utf-8")
os.environ["IPYTHONDIR"] = str(_kernels.parent)

autosummary_generate = True
autosummary_ignore_module_all = False
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
autodoc_typehints = "none"
autodoc_class_signature = "separated"

html_theme = "pydata_sphinx_theme"
html_title = "actuator-lti"
html_show_sourcelink = False
html_copy_source = False
html_static_path, html_css_files = ["_static"], ["site.css"]
html_sidebars = {"index": []}  # elsewhere the theme's own: the pages of the part that one is in
html_theme_options = {
    "show_prev_next": True,
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "navigation_with_keys": False,
}


def _plain_bars(app: object, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Docstrings write |L| for a magnitude; to reStructuredText bars are substitutions."""
    for number, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = line.split("``")
            parts[::2] = [part.replace("|", "\\|") for part in parts[::2]]
            lines[number] = "``".join(parts)


def _each_apart(app: object, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """What an argument or a field means begins a paragraph of its own."""
    for number in reversed(range(1, len(lines))):
        if lines[number - 1] and re.match(r"(``\w[^`]*``,? ?)+[^`:]*: ", lines[number]):
            lines.insert(number, "")


def setup(app: Sphinx) -> None:
    """Connect ahead of numpydoc, which rewrites the docstrings."""
    for rewrite in (_plain_bars, _each_apart):
        app.connect("autodoc-process-docstring", rewrite, priority=300)
