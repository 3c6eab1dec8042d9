"""Settings of the documentation."""

from pathlib import Path
from typing import Any

from click.testing import CliRunner
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer

import superfacets
from superfacets.cli.main import COMMANDS, commands

project = "superfacets"
author = copyright = "The superfacets developers"
release = superfacets.__version__

default_role = "autolink"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
]
exclude_patterns = ["_build", "help"]
templates_path = ["_templates"]
nitpicky = True
# Types of other projects and words of numpydoc's type descriptions, which have no page here.
nitpick_ignore_regex = [
    (r"py:.*", r"(numpy|np|npt|collections|os|pathlib|types)\..*"),
    (r"py:.*", r"(array_like|ndarray|optional|default|callable|path|float64|float32|int32|int64)"),
    (r"py:.*", r"(uint16|uint8|Path|PathLike|StopReason|Progress|npt|NDArray|ArrayLike|Any|shape)"),
    (r"py:.*", r"(pair|of|or|mesh|trimesh|PyVista|Open3D|integers|int|\(.*|.*\)|\{.*|.*\}|\d+.*)"),
    (r"py:.*", r"[\"'].*"),
]

myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "none"  # the docstrings say more
numpydoc_show_class_members = False

html_theme = "furo"
html_title = "superfacets"


def add_docstring_of_data(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Take the docstring of a preset from its module, because data has none at run time."""
    preset = name.removeprefix("superfacets.")
    documented = ModuleAnalyzer.for_module("superfacets.pipeline").find_attr_docs()
    if preset.isupper() and ("", preset) in documented:
        lines[:] = documented["", preset]


def skip_fields_of_tuples(
    app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any
) -> bool | None:
    """Leave out "Alias for field number 0": the class describes its fields."""
    return True if type(obj).__name__ == "_tuplegetter" else None


def write_help(app: Sphinx) -> None:
    """Write the help text of each command to ``help/COMMAND.txt``, for the page of the command."""
    folder = Path(app.srcdir, "help")
    folder.mkdir(exist_ok=True)
    for name in COMMANDS:
        arguments = [name, "--help"]
        text = CliRunner().invoke(commands, arguments, prog_name="superfacets", terminal_width=100)
        Path(folder, f"{name}.txt").write_text(text.output, encoding="utf-8")


def setup(app: Sphinx) -> None:
    app.connect("builder-inited", write_help)
    app.connect("autodoc-skip-member", skip_fields_of_tuples)
    app.connect("autodoc-process-docstring", add_docstring_of_data, priority=100)
