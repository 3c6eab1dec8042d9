"""Readers in a process of their own, files that are no meshes, and files of public data."""

import concurrent.futures
import gzip
import os
import random
import time

import numpy as np
import pytest
from damage import damaged
from mesh_files import off, ply_text, text_of
from test_io_round_trips import FILES

from superfacets import MeshError, read_cloud, read_mesh
from superfacets.files import guarded as module
from superfacets.files.guarded import guarded
from superfacets.files.readers.read import as_declared
from superfacets.tools.cell_file import CellFile

READERS = """
import os, signal, sys, time
import numpy as np
from superfacets import MeshError

def crash(data, ending): os.kill(os.getpid(), signal.SIGSEGV)
def abort(data, ending): os.abort()
def leave(data, ending): os._exit(0)
def quit(data, ending): raise SystemExit(0)
def hang(data, ending): time.sleep(60)
def fill(data, ending): return {"a": np.zeros(1 << 34)}
def refuse(data, ending): raise MeshError("no faces")
def fail(data, ending): return {"a": {}["gone"]}
def talk(data, ending):
    print("x" * 100_000, flush=True)
    os.write(1, b"y" * 100_000)
    return {"a": np.arange(3), "empty": np.zeros((0, 3)), "text": ending, "size": str(len(data))}
"""


@pytest.fixture
def readers(tmp_path, monkeypatch):
    (tmp_path / "readers_of_a_test.py").write_text(READERS)
    monkeypatch.syspath_prepend(str(tmp_path))


def test_a_reader_may_print_and_returns_arrays_and_texts(readers, capfd):
    found = guarded("readers_of_a_test:talk", b"123", ".abc")
    assert [*found] == ["text", "size", "a", "empty"]
    assert (found["text"], found["size"]) == (".abc", "3")
    assert found["a"].tolist() == [0, 1, 2]
    assert found["empty"].shape == (0, 3)
    assert capfd.readouterr() == ("", "")


UNWATCHED = pytest.mark.skipif(
    "san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer aborts then"
)


@pytest.mark.skipif(os.name == "nt", reason="no signals and no limit of memory")
@pytest.mark.parametrize(("name", "message"), [
    ("crash", "the reader of this format crashed: the file is damaged"),
    ("abort", "the reader of this format crashed: the file is damaged"),
    ("leave", "the reader of this format crashed: the file is damaged"),
    ("quit", "it may be truncated or damaged: SystemExit: 0"),
    ("hang", "reading takes too long: the file may be damaged"),
    pytest.param("fill", "reading takes too much memory: the file may be damaged", marks=UNWATCHED),
    ("refuse", "no faces"),
    ("fail", "it may be truncated or damaged: KeyError: 'gone'"),
])  # fmt: skip
def test_a_reader_that_fails_is_one_line(readers, monkeypatch, name, message):
    monkeypatch.setattr(module, "SECONDS", 2)
    with pytest.raises(MeshError) as caught:
        guarded(f"readers_of_a_test:{name}", b"1", ".abc")
    assert str(caught.value) == message


CUTS = {
    "vtk": FILES["a.vtk"], "tets.vtk": FILES["tets.vtk"], "msh": FILES["a.msh"],
    "mesh": FILES["a.mesh"], "vtu": FILES["a.vtu"],
}  # fmt: skip


def damaged_outcome(path, content):
    path.write_bytes(content)
    began = time.monotonic()
    try:
        cells = CellFile.read(path).cells()
        message, found = "", (cells.n_vertices, cells.n_cells)
    except MeshError as error:
        message, found = str(error), None
    assert "\n" not in message
    assert len(message) < len(str(path)) + 400
    assert time.monotonic() - began < 15  # including the start of Python
    return found


@pytest.mark.parametrize("kind", CUTS)
def test_damaged_files_neither_crash_nor_stall(kind, tmp_path):
    whole = CUTS[kind].encode()
    ending = kind[kind.rfind(".") + 1 :]
    source = random.Random(kind)
    contents = [whole, *(whole[: len(whole) * part // 5] for part in (2, 4))]
    contents += [damaged(whole, source) for _ in range(5)]
    paths = [tmp_path / f"{place}.{ending}" for place in range(len(contents))]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = list(pool.map(damaged_outcome, paths, contents))
    assert {*found} == {found[0], None}  # none is silently of another size


@pytest.mark.parametrize(("content", "message"), [
    (b"version https://git-lfs.github.com/spec/v1\noid sha256:1", "git lfs pull"),
    (b"\n<!DOCTYPE html><html>", "a web page"), (b"<HTML>", "a web page"),
    (b"PK\x03\x04" + b"1" * 30, "a ZIP archive: unpack it first"),
    (b"7z\xbc\xaf", "a compressed archive"), (b"II*\0", "a raster file"),
    (b"\x89PNG\r\n", "a picture"), (b"ISO-10303-21;", "STEP is a CAD format"),
    (b"%PDF-1.5", "a PDF document"), (b"\xff\xfe\0", "neither text in UTF-16 nor a mesh"),
    (b"\x1f\x8b damaged", "the gzip file has no valid end"),
    (gzip.compress(ply_text())[:-9], "the gzip file has no valid end"),
    (gzip.compress(bytes(80 << 20)), "more than 64 MB"),
])  # fmt: skip
def test_what_is_no_mesh_is_named_in_every_format(content, message):
    with pytest.raises(MeshError, match=message):
        as_declared(content)


@pytest.mark.parametrize("name", ["a.ply", "a.ply.gz", "A.PLY.GZ"])
def test_gzip_is_unpacked(read, name):
    assert read(name, gzip.compress(ply_text())).n_faces == 2


@pytest.mark.parametrize("code", ["utf-16", "utf-16-be"])
def test_text_in_utf_16_is_read(read, code):
    text = "\ufeff" * (code != "utf-16") + off().decode()
    assert read("a.off", text.encode(code)).n_faces == 2


def test_rows_of_off_may_have_several_lines(read):
    plain = read("a.off", off())
    head, body = off().split(b" 0\n", 1)
    wrapped = read("a.off", head + b" 0\n" + body.replace(b" ", b"\n"))
    joined = read("a.off", head + b" 0\n" + body.replace(b"\n", b" "))
    for mesh in (wrapped, joined):
        assert np.array_equal(mesh.vertices, plain.vertices)
        assert np.array_equal(mesh.faces, plain.faces)


@pytest.mark.parametrize("end", [b"\r\n", b"\n"])
def test_the_last_line_of_a_ply_header_may_end_otherwise(read, end):
    head, body = ply_text().split(b"end_header\n")
    assert read("a.ply", head + b"end_header" + end + body).n_faces == 2


def test_a_vertex_without_a_position_is_read_if_no_face_uses_it(read, refuse, tmp_path):
    text = b"v 0 0 0\nv nan nan nan\nv 1 0 0\nv 0 1 0\nf 1 3 4\n"
    assert np.isfinite(read("a.obj", text).vertices).all()
    attributes = CellFile.read(tmp_path / "a.obj").cells_and_attributes()[1]
    assert attributes.left_out == ("1 vertex without a position, which no face uses",)
    refuse("b.obj", text.replace(b"f 1 3 4", b"f 1 2 3"), "vertices[1]")


def test_points_of_obj_are_a_cloud(tmp_path):
    (tmp_path / "a.obj").write_text(
        "".join(f"v {row} 0.5 0 1\n" for row in text_of(np.eye(3)).splitlines())
    )
    cloud = read_cloud(tmp_path / "a.obj")
    assert cloud.points.tolist() == np.eye(3).tolist()
    assert np.allclose(cloud.colors[0] * 255, [128, 0, 255])
    with pytest.raises(MeshError, match="the file contains points, but no faces: use read_cloud"):
        read_mesh(tmp_path / "a.obj")


SIZES = {
    "gltf_instancing_used.gltf": 2400, "gltf_strip.gltf": 40, "gltf_no_scene.gltf": 800,
    "gltf_only_points.gltf": 8, "gltf_sparse.gltf": 12, "dodeca.vtk": 12, "msh_surface.msh": 12,
    "medit_lower.mesh": 5, "stl_named_patches.stl": 192, "vtk_tets_string.vtk": 5,
    "off_wrapped_faces.off": 6, "obj_points.obj": 8, "lh.surf.gii": 5120,
}  # fmt: skip
REFUSED = {
    "html.obj": "a web page", "lfs.glb": "git lfs pull", "lfs.ply": "git lfs pull",
    "lh.cortex.label.gii": "no surface", "lh.mask.shape.gii": "no surface",
}  # fmt: skip


def test_reported_files_are_read_or_refused_with_the_reason(data_dir):
    folder = data_dir / "reported" / "mesh"
    if not folder.is_dir():
        pytest.skip("the data have no folder `reported/mesh`")
    found, refused = {}, {}
    for path in sorted(folder.iterdir()):
        try:
            cells, attributes = CellFile.read(path).cells_and_attributes()
        except MeshError as error:
            refused[path.name] = str(error)
        else:
            found[path.name] = cells.n_cells
            assert "cells" in attributes.declared.values()
    assert refused.keys() == REFUSED.keys()
    assert all(REFUSED[name] in message for name, message in refused.items())
    assert found.items() >= SIZES.items()
