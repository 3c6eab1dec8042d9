"""Settings of the documentation."""

import sys
from pathlib import Path
from typing import Any

from click.testing import CliRunner
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer

import superfacets
from superfacets_cli.main import COMMANDS, commands

sys.path.insert(0, str(Path(__file__).resolve().parent))

from notebooks import write_notebook

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
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples", "help"]
templates_path = ["_templates"]
nitpicky = True
# Types of other projects and words of numpydoc's type descriptions have no page to link to.
nitpick_ignore_regex = [
    # parameters that are also fields, or modules without a page
    (r"py:obj", r"(weights|aggregation|balance|bounds|cells|dimension)"),
    (r"py:.*", r"(numpy|np|npt|collections|os|pathlib|types)\..*"),
    (r"py:.*", r"(array_like|ndarray|optional|default|callable|path|float64|float32|int32|int64)"),
    (r"py:.*", r"(uint16|uint8|Path|PathLike|StopReason|Progress|npt|NDArray|ArrayLike|Any|shape)"),
    (r"py:.*", r"(pair|of|or|mesh|trimesh|PyVista|Open3D|integers|int|\(.*|.*\)|\{.*|.*\}|\d+.*)"),
    (r"py:.*", r"[\"'].*"),
]

myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "none"  # docstrings describe the types
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": "classify_regions",  # needs the Princeton benchmark
    "within_subsection_order": "gallery_parts.position",
    "image_scrapers": ("matplotlib", "gallery_parts.save_plot"),
    "ignore_repr_types": "Plot",  # `save_plot` shows it
    "doc_module": ("superfacets",),
    "reference_url": {"superfacets": None},
    "backreferences_dir": "gallery/backreferences",
    "abort_on_example_error": True,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
}

html_theme = "furo"
html_title = "superfacets"


def add_docstring_of_data(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Read the docstring of a preset from the source: data has no docstring at run time."""
    preset = name.removeprefix("superfacets.")
    documented = ModuleAnalyzer.for_module("superfacets.pipeline").find_attr_docs()
    if preset.isupper() and ("", preset) in documented:
        lines[:] = documented["", preset]


def skip_fields_of_tuples(
    app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any
) -> bool | None:
    """Remove the docstrings "Alias for field number 0": the class documents its fields."""
    return True if type(obj).__name__ == "_tuplegetter" else None


PAGES_OF_COMMANDS = {
    "segment": "parameters.md", "levels": "howto/levels.md", "batch": "howto/batch.md",
    "render": "howto/pictures.md", "view": "howto/view.md", "studio": "howto/label.md",
    "agree": "howto/label.md#two-annotators", "convert": "howto/export.md",
    "regions": "howto/regions.md", "cut": "howto/cut.md", "transfer": "howto/transfer.md",
    "lift": "howto/lift.md", "evaluate": "metrics.md",
}  # fmt: skip


def write_help(app: Sphinx) -> None:
    """Write ``help/commands.md``, a section per command, which ``command.md`` includes."""
    sections = []
    for name in COMMANDS:
        is_long = name in ("segment", "batch")
        arguments = [name, "--help-all" if is_long else "--help"]
        text = CliRunner().invoke(commands, arguments, prog_name="superfacets", terminal_width=100)
        link = f"See []({PAGES_OF_COMMANDS[name]}).\n\n" if name in PAGES_OF_COMMANDS else ""
        sections.append(f"## {name}\n\n{link}```text\n{text.output}```\n")
    folder = Path(app.srcdir, "help")
    folder.mkdir(exist_ok=True)
    Path(folder, "commands.md").write_text("\n".join(sections), encoding="utf-8")


def write_tutorial(app: Sphinx) -> None:
    """Write the tutorial as a notebook for download."""
    write_notebook(Path(app.srcdir, "tutorial.md"))


def setup(app: Sphinx) -> None:
    app.connect("builder-inited", write_tutorial)
    app.connect("builder-inited", write_help)
    app.connect("autodoc-skip-member", skip_fields_of_tuples)
    app.connect("autodoc-process-docstring", add_docstring_of_data, priority=100)
