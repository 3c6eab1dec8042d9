"""The wall: the library knows its apps by strings only, and other packages add to its tables."""

import ast
import os
import re
import subprocess
import sys
import textwrap
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import superfacets
from superfacets import kit
from superfacets.base.lazy import Table

SOURCE = Path(superfacets.__file__).resolve().parents[1]

APPS = ("batch", "cli", "formats", "scans", "show", "studio", "textures")
MODULES = {"kit": kit, "metrics": superfacets.metrics, "sf": superfacets}
"""Modules of the package whose names in ``__all__`` are for apps."""

PUBLIC = {"superfacets", *(f"superfacets.{name}" for name in MODULES)}

MAY_POINT_DOWN = {"superfacets/segmentator.py"}

MAY_IMPORT = {
    "show": ["textures"], "scans": ["textures"], "studio": ["show", "scans", "textures"],
    "cli": APPS,
}  # fmt: skip
"""The other apps that each app may import from."""


def imports(path):
    """Yield module and name of each import of a file, and of each attribute of a public module."""
    package = path.relative_to(SOURCE).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names if alias.asname != "sf")
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*above, *filter(None, [node.module])])
            yield from ((module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Attribute) and getattr(node.value, "id", "") in MODULES:
            yield (MODULES[node.value.id].__name__, node.attr)


def is_module(name):
    path = SOURCE.joinpath(*name.split("."))
    return path.is_dir() or path.with_suffix(".py").is_file() or name == "superfacets._core"


def python(code, folder=""):
    """Run code in a new process, and return what it prints."""
    path = os.pathsep.join([str(folder), str(SOURCE)] if folder else [str(SOURCE)])
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_library_imports_no_app():
    found = [
        (path.relative_to(SOURCE).as_posix(), module)
        for path in sorted((SOURCE / "superfacets").rglob("*.py"))
        for module, _ in imports(path)
        if module.startswith("superfacets_")
    ]
    assert [each for each in found if each[0] not in MAY_POINT_DOWN] == []


def test_the_library_loads_no_app():
    code = """
        import sys, superfacets.pipeline, superfacets.files.readers.read
        import superfacets.files.writers.write, superfacets.tools.segment_file
        print([name for name in sys.modules if name.startswith("superfacets_")])
    """
    assert python(code) == "[]\n"


def test_each_name_in_the_tables_exists():
    from superfacets.files.formats import FORMATS
    from superfacets_cli.main import COMMANDS

    for table in (*FORMATS.values(), COMMANDS):
        assert all(table[key] is not None for key in table)


def taken_names():
    """Return what apps import from the library beyond public names: app, module and name."""
    documented = {*superfacets.__all__, "__version__", "kit"}
    found = set()
    for app in APPS:
        for path in sorted((SOURCE / f"superfacets_{app}").rglob("*.py")):
            for module, name in imports(path):
                if module.split(".")[0] != "superfacets":
                    continue
                listed = getattr(MODULES.get(module.rpartition(".")[2]), "__all__", documented)
                is_public = module in PUBLIC and name in listed
                whole = is_module(f"{module}.{name}")
                taken = f"{module}.{name} -" if whole else f"{module} {name or '-'}"
                if not is_public:
                    found.add(f"{app} {taken}")
    return found


def test_apps_take_only_public_names_and_names_of_the_kit_from_the_library():
    assert sorted(taken_names()) == []


def test_apps_take_of_each_other_only_the_few_names_of_their_packages():
    """A package also lists names that the page of the API documents."""
    public, taken = {*superfacets.__all__}, {app: set() for app in APPS}
    page = Path(__file__).parents[1].joinpath("docs/api.md").read_text(encoding="utf-8")
    documented = {app: set() for app in APPS}
    for module, table in re.findall(
        r"currentmodule:: superfacets_(\w+)\n(.*?)(?=\.\. c|```)", page, re.S
    ):
        documented[module] |= {*re.findall(r"^   (\w+)$", table, re.M)}
    names = {app: getattr(import_module(f"superfacets_{app}"), "__all__", []) for app in APPS}
    for app in APPS:
        for path in sorted((SOURCE / f"superfacets_{app}").rglob("*.py")):
            for module, name in imports(path):
                package, *modules = module.removeprefix("superfacets_").split(".")
                if module.startswith("superfacets_") and package != app:
                    assert not modules, (app, module, name)
                    assert package in MAY_IMPORT.get(app, ()), (app, module, name)
                    taken[package].add(name)
    for app in APPS:
        assert sorted(taken[app] | documented[app]) == sorted(names[app]), app
        assert not public & {*names[app]}
        assert len(names[app]) <= 20


def test_importing_a_package_loads_none_of_its_modules():
    packages = [f"superfacets_{app}" for app in APPS]
    code = f"""
        import sys, {", ".join(packages)}
        print([name for name in sys.modules if name.startswith("superfacets_")])
    """
    assert python(code) == f"{packages}\n"


ENTRY_POINTS = """
[superfacets.formats]
read.abc = abc_package:read
write_polygons.abc = abc_package:write
read.dot = abc_package:read_dots
read.lost = no_package:read

[superfacets.kinds]
abc_package.Dots = abc_package:DOTS

[superfacets.commands]
greet = abc_package:greet
fail = no_package:fail
"""

PACKAGE = """
import click, numpy as np
from superfacets import ArcMeasures, CellGraph
from superfacets.kit import Cells, Kind

class Dots(Cells):
    def __init__(self, places):
        self.places = places
        self.bounds = np.array([[0.0, 0, 0], [len(places), 0, 0]])
    n_cells = property(lambda self: len(self.places))

class DotsKind(Kind):
    name, noun, plural = "dots", "dot", "dots"
    def build_graph(self, cells, weld, n_threads):
        n = cells.n_cells
        places = np.column_stack([cells.places, np.zeros((n, 2))])
        neighbors = np.array([i + side for i in range(n) for side in (-1, 1) if 0 <= i + side < n])
        offsets = np.array([0, *(2 * np.arange(1, n) - 1), 2 * n - 2])
        arcs = ArcMeasures(np.ones(2 * n - 2))
        weights = np.ones(2 * n - 2)
        bounds = cells.bounds
        graph = CellGraph(
            places, np.ones(n), offsets, neighbors, weights, bounds, arc_measures=arcs
        )
        return graph, None

DOTS = DotsKind()
read = lambda source: source.mesh(np.eye(3), np.array([[0, 1, 2]]))
write = lambda file, content: file.write(b"abc %d" % content.cells.n_faces)
read_dots = lambda source: source.of_cells(
    Dots(np.frombuffer(source.data, np.uint8).astype(float))
)

@click.command("greet")
def greet():
    click.echo("good day")
"""


def other_package(folder):
    """Install a package that adds formats, a kind and commands; return its folder."""
    (folder / "abc_package.py").write_text(PACKAGE, encoding="utf-8")
    info = folder / "abc_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: abc-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS, encoding="utf-8")
    for name in ("mesh.abc", "some.dot", "no.lost"):
        (folder / name).write_bytes(b"\x01\x02\x03\x05")
    return folder


def explained_in(path):
    """Return the names that a module explains: by a docstring, or by a string below."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    named = {node.name for node in body if hasattr(node, "name") and ast.get_docstring(node)}
    for node, below in pairwise(body):
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            named |= {target.id for target in targets if isinstance(target, ast.Name)}
    return named


def test_the_kit_is_small_and_each_of_its_names_says_what_it_is():
    stub = ast.parse((SOURCE / "superfacets/kit.pyi").read_text(encoding="utf-8"))
    homes = {node.names[0].name: node.module for node in stub.body if hasattr(node, "module")}
    assert len(homes) <= 80
    assert len(superfacets.__all__) <= 80
    for name, module in homes.items():
        assert hasattr(kit, name), name
        assert "_core" not in module
        path = SOURCE.joinpath("superfacets", *module.split(".")).with_suffix(".py")
        assert name in explained_in(path), f"{name} has no docstring"


def test_another_package_adds_a_format_and_a_kind(tmp_path):
    folder = other_package(tmp_path)
    code = f"""
        import superfacets as sf
        mesh = sf.read_mesh(r"{folder / "mesh.abc"}")
        sf.write_mesh(r"{folder / "copy.abc"}", mesh)
        dots = sf.read_mesh(r"{folder / "some.dot"}")
        print(mesh, type(dots).__name__, sf.segment(dots, 2).n_segments)
        try:
            sf.read_mesh(r"{folder / "no.lost"}")
        except ImportError as error:
            print(error)
    """
    lines = python(code, folder).splitlines()
    assert lines[0] == "Mesh(3 vertices, 1 face) Dots 2"
    assert lines[1:] == ["no_package:read cannot be loaded: No module named 'no_package'"]
    assert (folder / "copy.abc").read_bytes() == b"abc 1"


def test_a_folder_in_place_of_a_list_of_entry_points_is_skipped(tmp_path, monkeypatch):
    (tmp_path / "other-info" / "entry_points.txt").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path)
    assert Table.added("superfacets.nothing") == {}


def test_another_package_adds_a_command(tmp_path):
    folder = other_package(tmp_path)
    done = {
        name: subprocess.run(
            [sys.executable, "-m", "superfacets", name],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(SOURCE)])},
            capture_output=True, text=True, check=False,
        ) for name in ("greet", "fail", "--help")
    }  # fmt: skip
    assert done["greet"].stdout == "good day\n"
    assert "greet" in done["--help"].stdout
    assert done["fail"].returncode == 1
    expected = "no_package:fail cannot be loaded: No module named 'no_package'"
    assert done["fail"].stderr == f"superfacets: error: {expected}\n"
