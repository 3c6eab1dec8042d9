"""What importing costs, and that the examples in the docstrings are true."""

import doctest
import importlib
import pkgutil
import subprocess
import sys

import pytest

import superfacets

MODULES = [
    module.name
    for module in pkgutil.walk_packages(superfacets.__path__, "superfacets.")
    if not module.name.endswith(("._core", ".__main__"))
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_are_true(name):
    importlib.import_module(name)
    module = sys.modules[name]  # some functions have the name of their module
    assert doctest.testmod(module).failed == 0


def test_importing_needs_numpy_and_the_core_alone():
    code = (
        "import sys, numpy; before = set(sys.modules); import superfacets;"
        "new = {name.split('.')[0] for name in set(sys.modules) - before};"
        "new -= sys.stdlib_module_names;"
        "print(sorted(new))"
    )
    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout
    # numpy loads parts of itself late.
    assert printed.strip() in ("['superfacets']", "['numpy', 'superfacets']")


def test_the_version_is_that_of_the_package():
    from importlib.metadata import version

    assert superfacets.__version__ == version("superfacets")
