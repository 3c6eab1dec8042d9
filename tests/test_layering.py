"""A folder is a layer: imports and includes point down the lists below, never up."""

import ast
import functools
import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src"
CORE = SOURCE / "core"
STUDIO_PAGE = ROOT / "frontend" / "src" / "studio"

# Lowest first. Each entry is a folder or a module of `superfacets`.
LIBRARY_LAYERS = [
    "base", "mesh", "graph", "weights", "cleanup", "clustering", "stages",
    "pipeline",  # up to here, the engine
    "paper", "regions", "metrics", "files", "tools",
    "kit",  # names of all layers, for apps
    "segmentator", "__init__", "__main__",
]  # fmt: skip
STUDIO_LAYERS = ["labels", "regions", "documents", "export", "web"]
CORE_LAYERS = [
    "base", "text", "mesh", "spatial", "cells", "spectral", "paths", "clustering", "regions",
    "bindings",
]  # fmt: skip
STUDIO_PAGE_LAYERS = ["text", "data", "session", "view", "workbench", "panels", "input", "main"]

# Highest folder of the core whose functions a layer of the library may call; others may call any.
HIGHEST_CORE_LAYERS = {
    "base": "mesh", "mesh": "mesh", "graph": "cells", "weights": "spectral", "pipeline": "base",
    "clustering": "clustering", "stages": "clustering", "files": "text", "tools": "cells",
}  # fmt: skip

EXCEPTIONS = {
    # Eigenvectors are computed on groups of cells.
    ("weights/parts.py", "_core.CoarseGraph")
}
"""Pairs (file, name of `_core`) that break a rule. This list may only shrink, and no list of
exceptions exists for imports and includes."""

CELL_CLASSES = {"Cells", "Mesh", "PolygonMesh", "TetMesh", "PointCloud", "FaceMesh", "AnyMesh"}
CELL_ROOMS = ("mesh", "graph.kinds")
"""Modules that may ask for the class of cells; all others ask `graph.kinds.kind_of`."""

LONGEST_TUPLE = 4


@functools.cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def modules_of(package):
    """Return the files of a package, keyed by the name within the package, ``graph.kinds``."""
    return {
        ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__"): path
        for path in sorted(package.rglob("*.py"))
    }


def is_for_types(node):
    """Return whether a node is a block of imports that only type checkers execute."""
    return isinstance(node, ast.If) and getattr(node.test, "id", None) == "TYPE_CHECKING"


def walk(node):
    """Yield all nodes below a node, also within functions, but not those for type checkers."""
    for child in ast.iter_child_nodes(node):
        if not is_for_types(child):
            yield child
            yield from walk(child)


def imported_modules(path, package):
    """Return the modules of a package that a file imports, at the top or within functions."""
    above, found = path.relative_to(package).parts[:-1], set()
    for node in walk(parsed(path)):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
            found |= {".".join(name[1:]) or "__init__" for name in names if name[0] == package.name}
        if not isinstance(node, ast.ImportFrom):
            continue
        base = list(above[: len(above) - node.level + 1]) if node.level else []
        target = (node.module or "").split(".") if node.module else []
        if not node.level:
            if target[:1] != [package.name]:
                continue
            target = target[1:]
        found |= {resolved([*base, *target, alias.name], package) for alias in node.names}
    return found - {"_core"}


def resolved(parts, package):
    """Return the module that ``from a.b import c`` imports: a.b.c if that is a module, else a.b."""
    path = package.joinpath(*parts)
    if path.is_dir() or path.with_suffix(".py").exists() or parts == ["_core"]:
        return ".".join(parts)
    return ".".join(parts[:-1]) or "__init__"


def imports_up(package, layers):
    """Return pairs (file, module) of imports that do not point down the list of layers."""
    found = set()
    for name, path in modules_of(package).items():
        if name == "__init__":  # lists the public names of all layers
            continue
        for module in imported_modules(path, package):
            own, other = (layers.index(each.split(".")[0]) for each in (name, module))
            if other > own:
                found.add((path.relative_to(package).as_posix(), module))
    return found


def includes_up(core, layers):
    found = set()
    for path in sorted(core.rglob("*.[ch]pp")):
        own = layers.index(path.relative_to(core).parts[0])
        for included in re.findall(r'#include "([^"]+)"', path.read_text(encoding="utf-8")):
            assert (core / included).exists(), included
            if layers.index(included.split("/")[0]) > own:
                found.add((path.relative_to(core).as_posix(), included))
    return found


def page_imports_up(page, layers):
    found = set()
    for path in sorted(page.rglob("*.ts")):  # none in a source distribution
        for name in re.findall(r'from "(\.[^"]+)"', path.read_text(encoding="utf-8")):
            target = Path(os.path.normpath(path.parent / f"{name}.ts"))
            assert target.exists(), name
            if not target.is_relative_to(page):  # it is shared with other pages
                continue
            own, other = (
                layers.index(each.relative_to(page).with_suffix("").parts[0])
                for each in (path, target)
            )
            if other > own:
                found.add((path.relative_to(page).as_posix(), name))
    return found


def layers_of_core_names():
    """Return the folder of the core of each name in `_core`, read from the files of bindings."""
    layers = {}
    for file in sorted((CORE / "bindings").glob("*.cpp")):
        text = file.read_text(encoding="utf-8")
        layers |= dict.fromkeys(re.findall(r'\bmodule(?:, |\.def\()\s*"(\w+)"', text), file.stem)
    return layers


def core_names_up(package, highest):
    """Return pairs (file, name of `_core`) of names above the highest folder for their layer."""
    found, layers = set(), layers_of_core_names()
    for module, path in modules_of(package).items():
        limit = CORE_LAYERS.index(highest.get(module.split(".")[0], CORE_LAYERS[-1]))
        for node in ast.walk(parsed(path)):
            names = []
            if isinstance(node, ast.Attribute) and getattr(node.value, "id", None) == "_core":
                names = [node.attr]
            elif isinstance(node, ast.ImportFrom) and node.module == "_core":
                names = [alias.name for alias in node.names]
            for name in names:
                if CORE_LAYERS.index(layers[name]) > limit:
                    found.add((path.relative_to(package).as_posix(), f"_core.{name}"))
    return found


def cell_tests(tree):
    """Return lines that test for a class of cells: by isinstance, type or match."""
    lines = []
    for node in ast.walk(tree):
        asked = []
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


def is_call_of_type(node):
    return isinstance(node, ast.Call) and getattr(node.func, "id", None) == "type"


def long_tuples(tree):
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


PACKAGE = SOURCE / "superfacets"


def test_layers_of_the_library_import_only_lower_layers():
    assert imports_up(PACKAGE, LIBRARY_LAYERS) == set()


def test_folders_of_the_studio_import_only_lower_folders():
    package = SOURCE / "superfacets_studio"
    top = [path.stem for path in sorted(package.glob("*.py")) if path.stem != "__init__"]
    assert imports_up(package, [*STUDIO_LAYERS, *top, "__init__"]) == set()


def test_folders_of_the_core_include_only_lower_folders():
    assert includes_up(CORE, CORE_LAYERS) == set()


def test_folders_of_the_page_of_the_studio_import_only_lower_folders():
    assert page_imports_up(STUDIO_PAGE, STUDIO_PAGE_LAYERS) == set()


def test_layers_of_the_library_call_no_higher_layer_of_the_core():
    assert core_names_up(PACKAGE, HIGHEST_CORE_LAYERS) == EXCEPTIONS


def test_each_name_of_the_core_has_a_layer():
    stub = parsed(PACKAGE / "_core.pyi")
    defined = {node.name for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert defined == layers_of_core_names().keys()


def test_no_public_function_has_the_name_of_a_module_beside_it():
    for stub in sorted(SOURCE.glob("superfacets*/__init__.pyi")):
        modules = {path.stem for path in stub.parent.iterdir() if path.stem != "__init__"}
        names = {alias.name for node in parsed(stub).body for alias in getattr(node, "names", [])}
        # `metrics`, `paper` and `segmentator` are modules of the library and public names.
        assert names & modules <= {"metrics", "paper", "segmentator"}, stub


def test_no_module_imports_itself_in_a_circle():
    for package in sorted(SOURCE.glob("superfacets*")):
        modules = modules_of(package)
        graph = {
            name: imported_modules(path, package) - {"__init__"} for name, path in modules.items()
        }
        while leaves := [name for name, targets in graph.items() if not targets & graph.keys()]:
            graph = {name: targets for name, targets in graph.items() if name not in leaves}
        assert graph.keys() <= {"__init__"}, f"among {sorted(graph)}"


def test_only_kinds_ask_for_the_class_of_cells():
    found = {
        name: lines
        for name, path in modules_of(PACKAGE).items()
        if not name.startswith(CELL_ROOMS) and (lines := cell_tests(parsed(path)))
    }
    assert not found, "ask graph.kinds.kind_of"


def test_no_function_returns_a_long_tuple():
    for package in sorted(SOURCE.glob("superfacets*")):
        found = {name: long_tuples(parsed(path)) for name, path in modules_of(package).items()}
        assert not {name: names for name, names in found.items() if names}


def written(folder, **files):
    """Write files whose names have ``__`` for ``/`` and ``_dot_`` for ``.``; return the folder."""
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("_dot_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def test_an_import_include_or_call_against_the_order_is_found(tmp_path):
    upward = "def f():\n    from ..regions.region_graph import colors\n"
    package = written(
        tmp_path / "superfacets", mesh__wrong_dot_py=upward, regions__region_graph_dot_py="",
        mesh__core_dot_py="from .. import _core\n_core.update_centers\n",
    )  # fmt: skip
    wrong = {("mesh/wrong.py", "regions.region_graph")}
    assert imports_up(package, LIBRARY_LAYERS) == wrong
    assert core_names_up(package, {"mesh": "mesh"}) == {("mesh/core.py", "_core.update_centers")}
    core = written(
        tmp_path / "core", mesh__wrong_dot_cpp='#include "cells/arcs.hpp"\n', cells__arcs_dot_hpp=""
    )
    assert includes_up(core, CORE_LAYERS) == {("mesh/wrong.cpp", "cells/arcs.hpp")}
    page = written(
        tmp_path / "page", data__wrong_dot_ts='import { Api } from "../session/api";\n',
        session__api_dot_ts="",
    )  # fmt: skip
    assert page_imports_up(page, STUDIO_PAGE_LAYERS) == {("data/wrong.ts", "../session/api")}


def test_a_test_of_the_class_of_cells_and_a_long_tuple_are_found():
    for text in (
        "isinstance(x, Mesh)", "isinstance(x, (int, PointCloud))", "isinstance(x, Mesh | TetMesh)",
        "type(x) is PolygonMesh", "type(x) in (Mesh, TetMesh)",
        "match x:\n    case TetMesh():\n        pass",
    ):  # fmt: skip
        assert cell_tests(ast.parse(text))
    assert not cell_tests(ast.parse("isinstance(x, CellGraph) and type(x) is int"))
    assert long_tuples(ast.parse("def f() -> tuple[int, int, int, int, str]: ..."))
    assert not long_tuples(ast.parse("def f() -> tuple[int, int, int, str]: ..."))
