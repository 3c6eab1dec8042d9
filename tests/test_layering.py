"""A folder is a layer: imports and includes point down the lists below, never up."""

import ast
import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "superfacets"
CORE = ROOT / "src" / "core"
STUDIO_PAGE = ROOT / "frontend" / "src" / "studio"

# Lowest first. A module belongs to the longest matching entry; entries on one line may import
# each other only within a folder.
PYTHON_LAYERS = [
    "_core",
    "errors",
    "_types",
    "_timing",
    "_validate",
    "_options",
    "mesh",
    "io",
    "io.readers",
    "adapters",
    "cells",
    "pictures",  # needs cells and labels only; results of the clustering call it
    "clustering",
    "regions",
    "metrics",
    "export",
    "pipeline",
    "interop",
    "nesting",
    "segmentator",
    "sample",
    "batches",
    "studio",
    "studio.labels",
    "studio.regions",
    "studio.documents",
    "studio.export",
    "studio.web",
    "__init__",
    "cli",
    "__main__",
]

CORE_LAYERS = [
    "base",
    "text",
    "mesh",
    "spatial",
    "cells",
    "spectral",
    "paths",
    "clustering",
    "regions",
    "bindings",
]

# Highest folder of the core whose functions a Python folder may call; others may call any.
HIGHEST_CORE_LAYERS = {
    "_validate": "mesh",
    "io": "mesh",
    "mesh": "mesh",
    "adapters": "mesh",
    "cells": "spectral",
    "pictures": "spectral",
    "clustering": "clustering",
    "regions": "regions",
}

# Exceptions: functions of higher folders of the core that a module may call.
CORE_EXCEPTIONS = {
    # `TetMesh.boundary` needs the neighbors across triangles.
    "mesh.tet_mesh": {"build_tet_graph"},
    # `pictures` and `clustering` show and return region graphs, so they cannot be in `regions`.
    "cells.region_adjacency": {"measure_regions", "region_arcs", "region_perimeters"},
    # `pictures` draws cut borders.
    "cells.border_cut": {"cut_borders"},
}

# Folders and top-level files of `frontend/src/studio`.
STUDIO_PAGE_LAYERS = ["data", "session", "view", "workbench", "panels", "input", "main"]


def layer_of(module: str) -> str:
    """Return the layer of a module, named from the package on: ``cells.weights``."""
    parts = module.split(".")
    for n in range(len(parts), 0, -1):
        if ".".join(parts[:n]) in PYTHON_LAYERS:
            return ".".join(parts[:n])
    raise AssertionError(f"superfacets.{module} is in no layer")


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


def imported_modules(path: Path) -> set[str]:
    """Return the modules of the package that a file imports, at the top or within functions."""
    package = path.relative_to(PACKAGE).parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
            found |= {name[12:] for name in names if name.startswith("superfacets.")}
        if not isinstance(node, ast.ImportFrom):
            continue
        if node.level:
            base = [*package[: len(package) - node.level + 1]]
        elif (node.module or "").split(".")[0] == "superfacets":
            base = []
        else:
            continue
        target = (node.module or "").removeprefix("superfacets").strip(".")
        base += target.split(".") if target else []
        found |= {resolve([*base, alias.name]) for alias in node.names}
    return found


def resolve(parts: list[str]) -> str:
    """Return the module that ``from a.b import c`` imports: a.b.c if that is a module, else a.b."""
    path = PACKAGE.joinpath(*parts)
    if path.is_dir() or path.with_suffix(".py").exists() or parts == ["_core"]:
        return ".".join(parts)
    return ".".join(parts[:-1]) or "__init__"


MODULES = sorted(PACKAGE.rglob("*.py"))
CORE_FILES = sorted(CORE.rglob("*.[ch]pp"))
STUDIO_PAGE_FILES = sorted(STUDIO_PAGE.rglob("*.ts"))  # empty in a source distribution


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_point_down(path):
    own = PYTHON_LAYERS.index(layer_of(name_of(path)))
    if name_of(path) == "__init__":
        return  # the public names of all layers
    for module in imported_modules(path):
        # The package itself provides only the version.
        if module == "__init__":
            assert own > PYTHON_LAYERS.index("sample"), module
            continue
        assert PYTHON_LAYERS.index(layer_of(module)) <= own, module


@pytest.mark.parametrize("path", CORE_FILES, ids=lambda path: str(path.relative_to(CORE)))
def test_includes_point_down(path):
    own = CORE_LAYERS.index(path.relative_to(CORE).parts[0])
    for included in re.findall(r'#include "([^"]+)"', path.read_text(encoding="utf-8")):
        assert (CORE / included).exists(), included
        assert CORE_LAYERS.index(included.split("/")[0]) <= own, included


@pytest.mark.parametrize(
    "path", STUDIO_PAGE_FILES, ids=lambda path: str(path.relative_to(STUDIO_PAGE))
)
def test_imports_of_the_page_of_the_studio_point_down(path):
    def layer(file: Path) -> int:
        return STUDIO_PAGE_LAYERS.index(file.relative_to(STUDIO_PAGE).with_suffix("").parts[0])

    for name in re.findall(r'from "(\.[^"]+)"', path.read_text(encoding="utf-8")):
        target = Path(os.path.normpath(path.parent / f"{name}.ts"))
        assert target.exists(), name
        if target.is_relative_to(STUDIO_PAGE):  # else, it is shared with other pages
            assert layer(target) <= layer(path), name


def layers_of_core_names() -> dict[str, str]:
    """Return the folder of the core of each name in `_core`, read from the files of bindings."""
    layers = {}
    for file in sorted((CORE / "bindings").glob("*.cpp")):
        text = file.read_text(encoding="utf-8")
        layers |= dict.fromkeys(re.findall(r'\bmodule(?:, |\.def\()\s*"(\w+)"', text), file.stem)
    return layers


def names_of_core(path: Path) -> set[str]:
    """Return the names of `_core` that a file uses."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and getattr(node.value, "id", None) == "_core":
            names.add(node.attr)
        if isinstance(node, ast.ImportFrom) and node.module == "_core":
            names |= {alias.name for alias in node.names}
    return names


CORE_NAMES = layers_of_core_names()


def test_each_name_of_the_core_has_a_layer():
    stub = ast.parse((PACKAGE / "_core.pyi").read_text(encoding="utf-8"))
    defined = (ast.ClassDef, ast.FunctionDef)
    assert {node.name for node in stub.body if isinstance(node, defined)} == CORE_NAMES.keys()


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_modules_call_no_higher_layer_of_the_core(path):
    highest = HIGHEST_CORE_LAYERS.get(layer_of(name_of(path)), CORE_LAYERS[-1])
    found = {
        name
        for name in names_of_core(path)
        if CORE_LAYERS.index(CORE_NAMES[name]) > CORE_LAYERS.index(highest)
    }
    assert found == CORE_EXCEPTIONS.get(name_of(path), set())


def test_a_call_of_a_higher_layer_of_the_core_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("test_layering.PACKAGE", tmp_path)
    (tmp_path / "mesh").mkdir()
    (tmp_path / "mesh" / "wrong.py").write_text("from .. import _core\n_core.update_centers\n")
    with pytest.raises(AssertionError, match="update_centers"):
        test_modules_call_no_higher_layer_of_the_core(tmp_path / "mesh" / "wrong.py")


def test_an_import_against_the_order_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("test_layering.PACKAGE", tmp_path)
    (tmp_path / "mesh").mkdir()
    (tmp_path / "pictures").mkdir()
    (tmp_path / "mesh" / "wrong.py").write_text("def f():\n    from ..pictures import colors\n")
    (tmp_path / "pictures" / "colors.py").write_text("")
    with pytest.raises(AssertionError, match=r"pictures\.colors"):
        test_imports_point_down(tmp_path / "mesh" / "wrong.py")


def test_an_include_against_the_order_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("test_layering.CORE", tmp_path)
    for folder in ("mesh", "cells"):
        (tmp_path / folder).mkdir()
    (tmp_path / "mesh" / "wrong.cpp").write_text('#include "cells/arcs.hpp"\n')
    (tmp_path / "cells" / "arcs.hpp").write_text("")
    with pytest.raises(AssertionError, match=r"cells/arcs\.hpp"):
        test_includes_point_down(tmp_path / "mesh" / "wrong.cpp")


def test_an_import_of_the_page_against_the_order_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("test_layering.STUDIO_PAGE", tmp_path)
    for folder in ("data", "session"):
        (tmp_path / folder).mkdir()
    (tmp_path / "data" / "wrong.ts").write_text('import { Api } from "../session/api";\n')
    (tmp_path / "session" / "api.ts").write_text("")
    with pytest.raises(AssertionError, match=r"session/api"):
        test_imports_of_the_page_of_the_studio_point_down(tmp_path / "data" / "wrong.ts")


def test_no_public_function_has_the_name_of_its_module():
    from superfacets import _MODULES

    assert not [name for name, module in _MODULES.items() if module.split(".")[-1] == name]


def test_no_module_imports_itself_in_a_circle():
    graph = {
        name_of(path): {m for m in imported_modules(path) if m != "__init__"} for path in MODULES
    }
    done: set[str] = set()

    def visit(module: str, above: tuple[str, ...]) -> None:
        assert module not in above, " -> ".join([*above, module])
        if module in done or module not in graph:
            return
        for target in graph[module]:
            # Modules of a package may import what the file of the package lists.
            visit(target, (*above, module))
        done.add(module)

    for module in graph:
        if module != "__init__":
            visit(module, ())


CELL_CLASSES = {
    "Cells",
    "Mesh",
    "PolygonMesh",
    "TetMesh",
    "PointCloud",
    "FaceMesh",
    "AnyMesh",
}
CELL_ROOMS = ("mesh", "adapters", "cells.kinds")


def cell_tests(tree: ast.AST) -> list[int]:
    """Return lines that test for a class of cells: by isinstance, type or match."""
    lines = []
    for node in ast.walk(tree):
        asked: list[ast.AST] = []
        if isinstance(node, ast.Call) and getattr(node.func, "id", None) in (
            "isinstance",
            "issubclass",
        ):
            asked = [node.args[1]]
        elif isinstance(node, ast.Compare) and any(map(is_call_of_type, ast.walk(node))):
            asked = [node]
        elif isinstance(node, ast.MatchClass):
            asked = [node.cls]
        names = {getattr(part, "id", None) for one in asked for part in ast.walk(one)}
        if names & CELL_CLASSES:
            lines.append(node.lineno)
    return lines


def is_call_of_type(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and getattr(node.func, "id", None) == "type"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_only_kinds_ask_for_the_class_of_cells(path):
    name = name_of(path)
    if name.startswith(CELL_ROOMS):
        return
    found = cell_tests(ast.parse(path.read_text(encoding="utf-8")))
    assert not found, f"lines {found}: ask cells.kinds.kind_of"


@pytest.mark.parametrize(
    "text",
    [
        "isinstance(x, Mesh)",
        "isinstance(x, (int, PointCloud))",
        "isinstance(x, Mesh | TetMesh)",
        "type(x) is PolygonMesh",
        "type(x) in (Mesh, TetMesh)",
        "match x:\n    case TetMesh():\n        pass",
    ],
)
def test_a_test_of_the_class_of_cells_is_found(text):
    assert cell_tests(ast.parse(text))
    assert not cell_tests(ast.parse("isinstance(x, CellGraph) and type(x) is int"))


LONGEST_TUPLE = 4
LONG_TUPLES: set[str] = set()
"""Modules that still have functions with longer tuples."""


def long_tuples(tree: ast.AST) -> list[str]:
    """Return functions that return a tuple of too many values to tell apart by place."""
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef) or not isinstance(node.returns, ast.Subscript):
            continue
        returned, inner = node.returns.value, node.returns.slice
        is_tuple = isinstance(returned, ast.Name) and returned.id == "tuple"
        if is_tuple and isinstance(inner, ast.Tuple) and len(inner.elts) > LONGEST_TUPLE:
            found.append(node.name)
    return found


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_function_returns_a_long_tuple(path):
    found = long_tuples(ast.parse(path.read_text(encoding="utf-8")))
    assert bool(found) == (name_of(path) in LONG_TUPLES), found


def test_a_long_tuple_is_found():
    assert long_tuples(ast.parse("def f() -> tuple[int, int, int, int, str]: ..."))
    assert not long_tuples(ast.parse("def f() -> tuple[int, int, int, str]: ..."))
