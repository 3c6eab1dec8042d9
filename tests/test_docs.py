"""Code and commands of the documentation run, and its list of public names is complete."""

import ast
import contextlib
import io
import itertools
import json
import re
import shlex
import shutil
import warnings
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import click
import gallery_meshes
import notebooks
import numpy as np
import pytest
import shapes
import shrink_images
import textured_meshes
from tools.sample_bear import parts_of

import superfacets as sf
from superfacets.kit import FORMATS
from superfacets_cli.main import commands

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md")), *sorted((DOCS / "howto").glob("*.md"))]

CHANNELS = ("red", "green", "blue")

FENCE = re.compile(r"(?:<!-- needs: (\w+) -->\n)?^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


class Block(NamedTuple):
    """A fenced block of a page."""

    needs: str | None
    language: str
    code: str
    line: int
    printed: str  # a block of plain text directly below


def read_blocks(path):
    """Return the fenced blocks of a page, with the line each begins at."""
    text = path.read_text(encoding="utf-8")
    found = list(FENCE.finditer(text))
    blocks = []
    for block, after in itertools.zip_longest(found, found[1:]):
        is_output = after is not None and after[2] == "text"
        is_output = is_output and not text[block.end() : after.start()].strip()
        line = text.count("\n", 0, block.start(3)) + 1
        blocks.append(Block(*block.group(1, 2, 3), line, after[3] if is_output else ""))
    return blocks


def python_blocks(path):
    return [block for block in read_blocks(path) if block.language == "python"]


@pytest.fixture(scope="module")
def made_files(tmp_path_factory, real_data):
    """Write the files that pages mention."""
    folder = tmp_path_factory.mktemp("files")
    with contextlib.chdir(folder):
        bear = sf.sample_mesh(5_000)
        channel = np.full(bear.n_vertices, 9, np.uint8)
        color = sf.MeshAttributes(vertex=dict.fromkeys(CHANNELS, channel))
        sf.write_mesh("scan.ply", bear, attributes=color)
        sf.write_labels("truth.seg", parts_of(bear.vertices, bear.faces))
        sf.write_mesh("assembly.ply", with_specks(bear))
        write_stl("part.stl", gallery_meshes.flange())
        write_obj("quads.obj", gallery_meshes.knot())
        write_tile("tile.las")
        textured_meshes.write_facade(folder)
        if find_spec("meshio"):
            sf.write_mesh("body.vtu", gallery_meshes.body())
        if real_data is not None:
            Path("psb").symlink_to(real_data / "psb")
    return folder


@pytest.fixture
def files(made_files, tmp_path, monkeypatch):
    """Return the current folder, with copies of these files."""
    shutil.copytree(made_files, tmp_path, symlinks=True, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def with_specks(mesh):
    """Return the mesh with 30 small boxes above it."""
    specks = [gallery_meshes.box(0.05 * i, 2, 0, 0.02, 0.02, 0.02) for i in range(30)]
    return gallery_meshes.merged([mesh, *specks])


def write_stl(path, mesh):
    records = np.zeros(mesh.n_faces, [("numbers", "<f4", 12), ("bytes", "<u2")])
    records["numbers"][:, 3:] = mesh.vertices[mesh.faces].reshape(-1, 9)
    count = np.uint32(mesh.n_faces).tobytes()
    Path(path).write_bytes(bytes(80) + count + records.tobytes())


def write_obj(path, mesh):
    lines = ["v {} {} {}\n".format(*vertex) for vertex in mesh.vertices.tolist()]
    lines += ["f {} {} {} {}\n".format(*mesh.face(i) + 1) for i in range(mesh.n_faces)]
    Path(path).write_text("".join(lines))


def write_tile(path):
    """Write points of flat ground and two gable roofs with 3 cm of noise, and their classes."""
    rng = np.random.default_rng(0)
    parts = [np.insert(rng.uniform(0, 40, (20_000, 2)), 2, 0, axis=1)]
    for x, y in [(10, 12), (28, 25)]:
        across, along = rng.uniform([-5, -7], [5, 7], (9_000, 2)).T
        parts.append(np.stack([x + across, y + along, 8 - np.abs(across) / 2], axis=1))
    points = np.concatenate(parts) + [500_000, 5_400_000, 0]
    points[:, 2] += rng.normal(0, 0.03, len(points))
    classes = np.repeat(np.array([2, 6], np.uint8), [20_000, 18_000])
    sf.write_mesh(path, points, attributes=sf.MeshAttributes(vertex={"classification": classes}))


def export_labels(path):
    """Label a few cells in the studio, and write the exports of the studio."""
    from superfacets_studio.documents.document import Document
    from superfacets_studio.export.write import write_export

    document = Document.open(Path(path))
    document.paint(np.arange(50, dtype=np.uint32), 1, objects=1)
    write_export(document, "cells", "npy")
    write_export(document, "objects", "json")
    document.close()


def run_page(path):
    """Run the blocks of a page in order, as a reader would."""
    names = {}
    for block in python_blocks(path):
        if block.needs is None or find_spec(block.needs) or Path(block.needs).is_dir():
            code = compile("\n" * (block.line - 1) + block.code, str(path), "exec")
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(code, names)
            assert printed.getvalue() == block.printed, f"{path.name}, line {block.line}"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_the_python_of_a_page_runs_and_prints_what_it_says(path, files):
    if path.stem == "scans":
        sf.write_mesh("scan.ply", gallery_meshes.scan(5_000))
    if path.stem == "label":
        export_labels("scan.ply")
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", UserWarning
        )  # of slivers and components, which pages explain
        run_page(path)


def cad_block(word):
    """The first block of the page of CAD parts that contains a word."""
    blocks = python_blocks(DOCS / "howto" / "cad.md")
    return next(block.code for block in blocks if word in block.code)


def test_gmsh_reads_regions_of_the_cad_page_as_surfaces(tmp_path, monkeypatch):
    meshio = pytest.importorskip("meshio")
    monkeypatch.chdir(tmp_path)
    whole = shapes.drilled_block(16)
    part = shapes.soup(whole)  # as in an STL file
    labels = sf.segment(part, 1, barriers=sf.sharp_edges(part, 30)).labels
    classes = np.array(["wall", "hole"])[np.arange(labels.max() + 1) % 2]
    exec(cad_block("gmsh"), {"part": part, "labels": labels, "classes": classes, "np": np})
    written = meshio.read("part.msh")
    assert np.array_equal(written.cell_data["gmsh:geometrical"][0], labels + 1)
    walls = written.cell_data["gmsh:physical"][0] == written.field_data["wall"][0]
    assert np.array_equal(walls, classes[labels] == "wall")
    faces = written.cells_dict["triangle"]
    assert np.array_equal(written.points[faces], part.vertices[part.faces])
    edges = part.n_faces * 3 // 2
    assert len(written.points) - edges + len(faces) == whole.n_vertices - whole.n_faces // 2
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()  # watertight


def test_the_first_example_runs_where_there_are_no_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_page(ROOT / "README.md")
    assert {path.name for path in tmp_path.iterdir()} == {"labeled.ply", "labeled.png"}


def test_blocks_are_run_in_a_row_and_what_they_print_is_compared(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nx = 1\n```\n\n```python\nprint(x)\n```\n\n```text\n1\n```\n")
    run_page(page)
    page.write_text("```python\nprint(2)\n```\n\n```text\n1\n```\n")
    with pytest.raises(AssertionError, match=r"page.md, line 2"):
        run_page(page)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_only_what_needs_other_libraries_or_the_benchmark_may_be_left_out(path):
    needs = {block.needs for block in read_blocks(path)} - {None}
    others = {"distributed", "scipy", "shapely", "geopandas", "skimage"}
    assert needs <= {"trimesh", "pyvista", "psb", "meshio", "pandas", *others}
    assert all(compile(block.code, str(path), "exec") for block in python_blocks(path))


def shown_commands(path):
    """Return the arguments of `superfacets` on each line of a page's blocks with this command."""
    for block in read_blocks(path):
        if block.language in ("sh", "console", "text"):
            for line in re.findall(r"(?:^|\| )(?:\$ )?superfacets (.*)", block.code, re.MULTILINE):
                words = shlex.split(line, comments=True)
                yield list(itertools.takewhile(lambda word: word not in ("|", ">"), words))


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_commands_that_pages_show_have_the_options_that_they_use(path):
    for words in shown_commands(path):
        with commands.make_context("superfacets", list(words)) as context:
            name, command, rest = commands.resolve_command(context, words)
            try:
                command.make_context(name, list(rest), parent=context)
            except click.BadParameter as error:
                if "does not exist" not in error.message:
                    raise
            except click.exceptions.Exit:  # raised by --help
                pass


def test_a_command_with_an_option_that_there_is_not_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```sh\nsuperfacets segment a.ply -n 3 --fast  # a comment\n```\n")
    with pytest.raises(click.NoSuchOption, match="--fast"):
        test_commands_that_pages_show_have_the_options_that_they_use(page)


MODULES = ("metrics", "paper", "segmentator")


def public_names():
    """Return the full name of everything public, as the API reference lists it."""
    modules = {f"superfacets.{name}": import_module(f"superfacets.{name}") for name in MODULES}
    modules["superfacets"] = sf
    return [
        f"{path}.{name}"
        for path, module in modules.items()
        for name in module.__all__
        if not isinstance(getattr(module, name), ModuleType)
    ]


def listed_names(page):
    """Return the names in the autosummary tables of a page."""
    names, module = [], ""
    for line in page.splitlines():
        if line.startswith(".. currentmodule:: "):
            module = line.split()[-1]
        elif re.fullmatch(r"   \w+", line):
            names.append(f"{module}.{line.strip()}")
    return names


def test_every_public_name_has_a_page():
    listed = listed_names((DOCS / "api.md").read_text(encoding="utf-8"))
    assert len({*listed}) == len(listed)
    assert {*public_names()} <= {*listed}
    for name in {*listed} - {*public_names()}:  # results, and names of apps
        module, _, attribute = name.rpartition(".")
        assert hasattr(import_module(module), attribute), name


def test_docstrings_name_all_formats_that_are_read():
    for role, reader in (("read", sf.read_mesh), ("read_points", sf.read_cloud)):
        assert [each for each in FORMATS[role] if f"``{each}``" not in reader.__doc__] == []


def test_the_docstring_and_the_page_name_all_metrics():
    square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    page = (DOCS / "metrics.md").read_text(encoding="utf-8")
    for name in sf.metrics.evaluate(square, [0, 1], [[3, 3]]):
        assert f"``{name}``" in sf.metrics.evaluate.__doc__, name
        assert f"`{name}`" in page, name


def test_every_example_has_a_place_in_the_gallery_and_one_page_for_it():
    """`make docs` runs the examples."""
    examples = {path.stem for path in (DOCS / "examples").glob("*.py")}
    order = ast.parse((DOCS / "gallery_parts.py").read_text(encoding="utf-8"))
    listed = next(
        ast.literal_eval(node.value) for node in order.body if isinstance(node, ast.Assign)
    )
    assert set(listed) == examples
    assert len(set(listed)) == len(listed)
    assert set(notebooks.EXAMPLES) <= examples


def test_a_page_becomes_a_notebook_of_its_text_and_code(tmp_path, monkeypatch):
    monkeypatch.setattr(notebooks, "DOCS", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("# A\n\n[b](howto/b.md#c)\n\n```python\nx = 1\n```\n\n```text\n1\n```\n\nEnd\n")
    notebooks.write_notebook(page)
    cells = json.loads((tmp_path / "notebooks" / "page.ipynb").read_text())["cells"]
    assert [cell["cell_type"] for cell in cells] == ["markdown", "code", "markdown"]
    assert [cell["source"] for cell in cells] == [
        f"# A\n\n[b]({notebooks.SITE}howto/b.html#c)", "x = 1", "End",
    ]  # fmt: skip


def test_pictures_are_small():
    """`python docs/shrink_images.py` makes pictures small."""
    sizes = {path.name: path.stat().st_size for path in (DOCS / "images").rglob("*.*")}
    assert {name for name, size in sizes.items() if size > shrink_images.MAX_BYTES} == set()


def test_links_of_the_readme_lead_somewhere():
    links = re.findall(r"\]\(([^)#:]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert "docs/tutorial.md" in links
    assert [link for link in links if not (ROOT / link).exists()] == []


@pytest.mark.parametrize("name", ["flange", "terrain", "scan", "room", "knot"])
def test_generated_meshes_of_the_gallery_are_sound(name):
    made = getattr(gallery_meshes, name)()
    info = sf.mesh_info(made[0] if name == "room" else made)
    assert info.n_faces < 300_000
    assert info.n_inconsistent_edges == 0
    assert (info.n_components == 1) == (name in ("flange", "terrain", "knot"))
