"""The cost of importing, and that the examples in docstrings are correct."""

import ast
import dataclasses
import doctest
import importlib
import inspect
import json
import pkgutil
import re
import subprocess
import sys
import textwrap
from importlib.metadata import files
from itertools import pairwise
from pathlib import Path

import pytest

import superfacets

MODULES = [
    module.name
    for module in pkgutil.walk_packages(superfacets.__path__, "superfacets.")
    if not module.name.endswith(("._core", ".__main__"))
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_are_true(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some examples write files
    importlib.import_module(name)
    module = sys.modules[name]  # some functions have the name of their module
    assert doctest.testmod(module).failed == 0


@pytest.mark.parametrize("name", MODULES)
def test_headings_in_docstrings_have_lines_of_their_own(name):
    source = inspect.getsource(importlib.import_module(name))
    assert re.findall(r"^ *(?:Notes|Examples|References|See Also) -+ .*", source, re.M) == []


def names_in_section(docstring: str, section: str) -> set[str]:
    """Return the names that a section of a numpydoc docstring describes."""
    found = re.search(
        rf"^{section}\n-+\n(.*?)(?=^\S[^\n]*\n---|\Z)", docstring, re.MULTILINE | re.DOTALL
    )
    headings = re.findall(r"^\S.*$", found[1], re.MULTILINE) if found else []
    return {
        name.strip().lstrip("*") for line in headings for name in line.split(" : ")[0].split(",")
    }


NAMES = [name for name in superfacets.__all__ if not inspect.ismodule(getattr(superfacets, name))]
PUBLIC = [getattr(superfacets, name) for name in NAMES if name != "SCANS"]
FUNCTIONS = [value for value in PUBLIC if inspect.isfunction(value)]
RESULTS = [
    value for value in PUBLIC if dataclasses.is_dataclass(value) or hasattr(value, "_fields")
]


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.__name__)
def test_the_documented_parameters_are_those_there_are(function):
    docstring = inspect.getdoc(function)
    documented = names_in_section(docstring, "Parameters")
    documented |= names_in_section(docstring, "Other Parameters")
    assert documented == set(inspect.signature(function).parameters)


@pytest.mark.parametrize("kind", RESULTS, ids=lambda kind: kind.__name__)
def test_the_documented_fields_are_those_there_are(kind):
    """A field is described in the docstring of its class or in a string below the field."""
    fields = set(getattr(kind, "_fields", ())) or {
        field.name for field in dataclasses.fields(kind) if not field.name.startswith("_")
    }
    properties = {
        name
        for name, value in vars(kind).items()
        if isinstance(value, property) and inspect.getdoc(value)
    }
    docstring = inspect.getdoc(kind)
    documented = names_in_section(docstring, "Attributes")
    documented |= names_in_section(docstring, "Parameters")
    assert documented <= fields | properties
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body
    below = {
        one.target.id
        for one, other in pairwise(body)
        if isinstance(one, ast.AnnAssign)
        and isinstance(getattr(other, "value", 0), ast.Constant)
        and isinstance(other, ast.Expr)
    }
    assert fields <= documented | below


MODULE_NAMES = sorted({*superfacets.__all__} - {*NAMES})
LATE = ("cells.info", "cli", "io", "metrics", "pictures", "reference", "sample", "study")
LATE_PREFIXES = tuple(f"superfacets.{name}" for name in LATE)


def run_python(code: str) -> str:
    """Return what the code prints in another process."""
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()


def test_importing_needs_numpy_and_the_core_alone():
    printed = run_python(
        "import sys, numpy; before = set(sys.modules); import superfacets;"
        "new = {name.split('.')[0] for name in set(sys.modules) - before};"
        "new -= sys.stdlib_module_names;"
        "print(sorted(new))"
    )
    # numpy imports some of its modules late.
    assert printed in ("['superfacets']", "['numpy', 'superfacets']")


def test_importing_leaves_files_and_pictures_for_later():
    loaded = run_python("import sys, superfacets; print(*sys.modules)").split()
    assert "superfacets.pipeline" not in loaded
    assert not [name for name in loaded if name.startswith(LATE_PREFIXES)]


@pytest.mark.parametrize("first", [
    "import superfacets_show.rendering",
    "import superfacets_cli.main",
    "from superfacets.files.readers.read import read_mesh",
    "import superfacets.pipeline, superfacets.clustering.classification",
    "from superfacets import *",
    "import superfacets; superfacets.metrics, superfacets.sample_mesh, superfacets.read_mesh",
    "import superfacets; [importlib.import_module(n) for n in names]",
    "import superfacets; superfacets.plot, superfacets.plot",
])  # fmt: skip
def test_public_names_are_what_they_should_be_whatever_was_imported_before(first):
    run_python(
        f"import importlib; names = {MODULES}; {first}\n"
        "import inspect, superfacets\n"
        f"for name in {NAMES}:\n"
        "    value = getattr(superfacets, name)\n"
        "    assert not inspect.ismodule(value), name\n"
        "    assert name == 'SCANS' or value.__name__ == name, name\n"
        "    assert value is getattr(superfacets, name), name\n"
    )


def test_names_that_are_loaded_late_are_listed():
    listed = run_python("import superfacets; print(*dir(superfacets))").split()
    assert {*superfacets.__all__} <= set(listed)


@pytest.mark.parametrize("name", MODULE_NAMES)
def test_modules_that_are_loaded_late_are_attributes(name):
    assert run_python(f"import superfacets; print(superfacets.{name}.__name__)").endswith(name)


def test_no_module_has_a_public_name():
    """Importing such a module would replace the public function of that name."""
    children = [name for name in MODULES if name.count(".") == 1]
    assert not {name.rpartition(".")[2] for name in children} & {*NAMES}


def test_what_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"^module 'superfacets' has no attribute 'nothing'$"):
        superfacets.nothing  # noqa: B018
    with pytest.raises(ImportError):
        from superfacets import nothing  # noqa: F401


def test_the_version_is_that_of_the_package():
    from importlib.metadata import version

    assert superfacets.__version__ == version("superfacets")


def test_the_types_of_the_core_are_those_it_has(tmp_path):
    """`make stub` writes the file again."""
    pytest.importorskip("nanobind")
    stub = tmp_path / "_core.pyi"
    command = ["-m", "nanobind.stubgen", "-q", "-m", "superfacets._core", "-o", str(stub)]
    subprocess.run([sys.executable, *command], check=True)
    committed = Path(superfacets.__file__).with_name("_core.pyi")
    assert committed.read_text() == stub.read_text()


def test_the_package_lists_what_is_compiled_into_it():
    (path,) = (path for path in files("superfacets") if path.parent.name == "sboms")
    document = json.loads(path.read_text())
    assert document["metadata"]["component"]["version"] == superfacets.__version__
    found = {part["name"]: part["version"] for part in document["components"]}
    assert found.keys() == {"nanobind", "robin-map"}
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", number) for number in found.values())
    used = {name for one in document["dependencies"] for name in one["dependsOn"]}
    assert used == {part["bom-ref"] for part in document["components"]}


def test_the_version_is_the_same_everywhere():
    root = Path(__file__).resolve().parents[1]
    for name, pattern in (
        ("CITATION.cff", r"^version: (\S+)$"),
        ("recipe/recipe.yaml", r'version: "(.+)"'),
    ):
        (found,) = re.findall(pattern, (root / name).read_text(encoding="utf-8"), re.MULTILINE)
        assert found == superfacets.__version__.removesuffix(".dev0"), name
