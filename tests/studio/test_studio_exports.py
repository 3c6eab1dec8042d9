"""Exports of the studio, and imports of them and of files of other tools."""

import base64
import csv
import io
import json
import os
from pathlib import Path

import numpy as np
import pytest
from textured_meshes import grid, save_png

import superfacets
from superfacets import Texture, read_attributes, read_labels, vertex_labels
from superfacets_studio.documents.document import Document
from superfacets_studio.documents.files import Files
from superfacets_studio.export.write import export_bytes, write_export
from superfacets_studio.labels.imports import read_import
from superfacets_textures import Material, TextureImage


@pytest.fixture
def painted(document):
    """Return a document with two regions of class 1 and one of class 2."""
    for region, number in ((3, 1), (4, 1), (5, 2)):
        document.paint(document.revision.cells_of(region), number)
    document.set_classes(
        [{"id": 1, "name": "roof", "color": "#ff0000"}, {"id": 2, "name": "wall", "key": "w"}]
    )
    return document


@pytest.mark.parametrize("format", ["npy", "seg", "txt", "ply"])
def test_classes_of_cells_are_read_back(painted, format):
    path = write_export(painted, "cells", format)
    assert path.name == f"sheet.classes.{format}"
    assert np.array_equal(read_labels(path), painted.state.classes)


@pytest.mark.parametrize(
    ("work", "stem"),
    [("ann2.studio.jsonl", "ann2"), ("ann2.jsonl", "ann2"), ("sheet.studio.jsonl", "sheet.studio"),
     ("merged/sheet.ply.studio.jsonl", "sheet")],
)  # fmt: skip
def test_exports_of_another_work_file_replace_none_of_the_default_one(painted, work, stem):
    first = write_export(painted, "cells", "npy")
    content = first.read_bytes()
    path = painted.path.parent / work
    path.parent.mkdir(exist_ok=True)
    other = Document.open(painted.path, path, n_segments=20)
    assert write_export(other, "cells", "npy") == path.with_name(f"{stem}.classes.npy")
    assert Files([painted.path], path).targets(None) == [(0, path.with_name("sheet"))]
    assert write_export(other, "regions", "npy").name == f"{stem}.superfacets.npy"
    name, _ = export_bytes(other, "objects", "aggregation.json")
    assert name == f"{stem}.objects.scannet.zip"
    other.close()
    assert first.read_bytes() == content


def test_the_default_work_file_may_be_named_on_the_command_line(painted):
    painted.close()
    again = Document.open(painted.path, Path(os.path.relpath(painted.journal.path)))
    assert write_export(again, "cells", "npy").name == "sheet.classes.npy"
    again.close()


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_an_export_replaces_a_link_and_not_the_file_behind_it(painted, tmp_path):
    private = tmp_path / "private"
    private.write_text("mine")
    (tmp_path / "sheet.classes.npy").symlink_to(private)
    assert np.array_equal(read_labels(write_export(painted, "cells", "npy")), painted.state.classes)
    assert private.read_text() == "mine"


def test_a_mesh_has_the_colors_of_the_classes(painted):
    attributes = superfacets.read_attributes(write_export(painted, "cells", "ply")).face
    of_one = painted.state.classes == 1
    assert (attributes["red"][of_one] == 255).all()
    assert (attributes["green"][of_one] == 0).all()
    assert (attributes["blue"][painted.state.classes == 0] == 190).all()


def test_groups_of_obj_are_named_by_class_or_by_region(painted):
    def groups(what):
        lines = write_export(painted, what, "obj").read_text().splitlines()
        return [line[2:] for line in lines if line.startswith("g ")]

    assert groups("cells") == ["unknown", "roof", "wall"]
    assert groups("regions") == [f"region_{i}" for i in range(painted.revision.n_regions)]


def test_glb_has_the_colors_of_the_classes(painted):
    data = write_export(painted, "cells", "glb").read_bytes()
    gray = ((190 / 255 + 0.055) / 1.055) ** 2.4  # of no class, in linear light
    assert all(np.array(color, "<f4").tobytes() in data for color in ([1, 0, 0], [gray] * 3))
    assert b"roof" in data


def test_classes_of_vertices_are_the_majority_around_them(painted):
    expected = vertex_labels(
        painted.cells, painted.state.classes.astype(np.int32), method="majority"
    )
    assert np.array_equal(read_labels(write_export(painted, "vertices", "npy")), expected)
    path = write_export(painted, "vertices", "labels.ply")
    found = read_attributes(path).vertex
    assert (path.name.endswith(".labels.ply"), found["label"].dtype) == (True, np.uint16)
    assert np.array_equal(found["label"], expected)
    assert len({*zip(found["label"], found["red"], found["green"], strict=True)}) == len(
        np.unique(expected)
    )
    segments = json.loads(write_export(painted, "vertices", "segs.json").read_text())["segIndices"]
    assert segments == expected.tolist()


def test_regions_and_their_classes_are_written(painted):
    labels = read_labels(write_export(painted, "regions", "npy"))
    assert np.array_equal(labels, painted.revision.labels)
    assert b"roof" in write_export(painted, "regions", "glb").read_bytes()


def test_the_class_of_a_region_is_that_of_most_of_its_area(painted):
    few = painted.revision.cells_of(3)[:2]
    painted.paint(few, 2)
    name, content = export_bytes(painted, "region_classes", "csv")
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert name == "sheet.region-classes.csv"
    assert [row["name"] for row in rows[2:6]] == ["unknown", "roof", "roof", "wall"]
    areas = painted.areas
    share = 1 - areas[few].sum() / areas[painted.revision.cells_of(3)].sum()
    assert float(rows[3]["share"]) == pytest.approx(share)
    assert json.loads(export_bytes(painted, "region_classes", "json")[1])[4]["class"] == 1
    assert read_labels(write_export(painted, "region_classes", "npy")).tolist()[3:6] == [1, 1, 2]


def test_a_file_of_another_tool_is_not_replaced_unasked(painted):
    path = painted.path.with_name("sheet.bin")
    path.write_text("made by hand")
    with pytest.raises(FileExistsError, match=r"sheet\.bin exists already"):
        write_export(painted, "regions", "bin")
    assert path.read_text() == "made by hand"
    write_export(painted, "regions", "bin", replace=True)
    assert path.stat().st_size == 8 * painted.cells.n_vertices
    write_export(painted, "cells", "npy")
    write_export(painted, "cells", "npy")  # an export of the studio


def test_exports_are_sent_and_written(client, sheet):
    client.paint_regions(3, 0, 1)
    written = client.done("export", what="cells", format="npy")
    assert written["path"] == str(sheet.with_name("sheet.classes.npy"))
    answer = client.get("export", what="cells", format="npy")
    assert answer.headers["content-disposition"] == "attachment; filename*=UTF-8''sheet.classes.npy"
    assert answer.content == sheet.with_name("sheet.classes.npy").read_bytes()
    sheet.with_name("sheet.bin").write_bytes(b"mine")
    assert client.post("export", what="regions", format="bin").status_code == 409
    assert client.done("export", what="regions", format="bin", replace=True)["name"] == "sheet.bin"


def test_what_was_exported_is_imported_as_one_operation(client):
    client.paint_regions(3, 0, 1)
    client.paint_regions(5, 2)
    before = client.classes()
    for format in ("npy", "seg", "sstk.json"):
        data = client.get("export", what="cells", format=format).content
        everything = np.arange(len(before), dtype="<u4").tobytes()
        client.done("paint", **{"class": 0}, cells=base64.b64encode(everything).decode())
        file = {"name": f"x.{format}", "data": base64.b64encode(data).decode()}
        assert client.done("import", files=[file])["changed"] == np.count_nonzero(before)
        assert np.array_equal(client.classes(), before)
        client.done("undo")
        assert not client.classes().any()
        client.done("undo")
        assert np.array_equal(client.classes(), before)


def _read(files, cells=None, known=()):
    mesh = superfacets.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    return read_import(files, mesh if cells is None else cells, known)


def test_points_have_labels_of_their_own():
    cloud = superfacets.PointCloud([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    found = _read({"a.segs.json": b'{"segIndices":[0,2,1]}'}, cloud)
    assert found.classes.tolist() == [0, 2, 1]
    assert [entry["id"] for entry in found.class_list] == [1, 2]


def test_a_cell_gets_what_most_of_its_corners_have():
    groups = b'{"segGroups":[{"label":"x","segments":[-9]},{"label":"y","segments":[4294967296]}]}'
    ids = b'{"segIndices":[-9,-9,4294967296,4294967296]}'  # as of other tools
    far = {"a.segs.json": ids, "a.aggregation.json": groups}
    for files in (far, {"a.segs.json": b'{"segIndices":[1,1,2,2]}'}, {"a.txt": b"1\n1\n2\n2\n"}):
        assert _read(files).classes.tolist() == [1, 2]


@pytest.mark.parametrize(("files", "message"), [
    ({}, r"import one label file, with at most one \.aggregation\.json"),
    ({"a.npy": b"", "b.npy": b""},
     r"import one label file, with at most one \.aggregation\.json"),
    ({"a.aggregation.json": b"{}"},
     r"import one label file, with at most one \.aggregation\.json"),
    ({"a.sstk.json": b"[[["}, "is not valid JSON"),
    ({"a.segs.json": b"\xff"}, "is not valid JSON"),
    ({"a.exe": b""}, "expected the ending .sstk.json"),
    ({"a.seg": b"0\n1\n2\n"},
     r"a\.seg: labels must have one value per face \(2\) or per vertex \(4\), got 3 values"),
    ({"a.seg": b"0\n70000\n"},
     "label 70000 is not a class: classes are 1 to 65535, and 0 and -1 mean no class"),
    ({"a.seg": b"0\n-5\n"}, r"a\.seg: labels\[1\] must be -1 to 2147483647, got -5"),
    ({"a.sstk.json": b'{"segmentation":[{"index":[0,-5]}]}'}, "label -5 is not a class"),
    ({"a.segs.json": b"{"}, r"a\.segs\.json: "),
    ({"a.segs.json": b"{}"}, r"a\.segs\.json: the entry 'segIndices' is missing"),
    ({"a.segs.json": b'{"segIndices":[1.5]}'}, "must be a list of whole numbers"),
    ({"a.segs.json": b'{"segIndices":[1]}'},
     r"a\.segs\.json: segIndices must have one value per vertex \(4\), got 1 value"),
    ({"a.sstk.json": b'{"segmentation":[{"index":[1]}]}'},
     r"a\.sstk\.json: index must have one value per cell \(2\), got 1 value"),
    ({"a.sstk.json": b'{"segmentation":[]}'}, "a.sstk.json: .*it contains an empty list"),
    ({"a.sstk.json": b"[" * 100_000}, "a.sstk.json: .*it is nested too deeply"),
    ({"a.segs.json": b'{"segIndices":[18446744073709551615]}'}, "does not fit into 64 bits"),
    ({"a.segs.json": b'{"segIndices":[NaN,0,0,0]}'}, "a.segs.json: .*has the number NaN"),
    ({"a.seg": b"0\n1\n", "a.aggregation.json": b'{"segGroups":[{"label":"x"}]}'},
     r"a\.aggregation\.json: the entry 'segments' is missing"),
])  # fmt: skip
def test_wrong_imports_say_what_is_wrong(files, message):
    with pytest.raises(superfacets.MeshError, match=message):
        _read(files)


@pytest.fixture
def textured(tmp_path):
    """Return the document of a wall with an image, whose left half has class 1."""
    mesh, pairs = grid(6, 6, 1, 1)
    save_png(tmp_path / "wall.png", np.arange(8 * 8 * 3, dtype=np.uint8).reshape(8, 8, 3))
    image = TextureImage("wall.png", tmp_path / "wall.png")
    texture = Texture(
        pairs, mesh.faces.ravel(), [Material("wall", image=image)], [0] * mesh.n_faces
    )
    attributes = superfacets.MeshAttributes(texture=texture)
    superfacets.write_mesh(tmp_path / "wall.obj", mesh, attributes=attributes)
    opened = Document.open(tmp_path / "wall.obj", n_segments=4)
    opened.paint(np.flatnonzero(pairs[mesh.faces].mean(axis=1)[:, 0] < 0.5), 1)
    yield opened
    opened.close()


@pytest.mark.parametrize("what", ["cells", "regions"])
@pytest.mark.parametrize("format", ["obj", "glb"])
def test_textures_stay_with_exported_meshes(textured, what, format):
    source = textured.source.texture
    path = write_export(textured, what, format)
    found = superfacets.read_attributes(path).texture
    (image,) = found.images
    assert np.array_equal(image.pixels(), source.images[0].pixels())
    mesh = superfacets.read_mesh(path)

    def rows(cells, texture):
        pairs = texture.coordinates[texture.corners].reshape(-1, 6)
        places = cells.vertices[cells.faces].reshape(-1, 9)
        return sorted(np.hstack([places, pairs]).round(5).tolist())

    assert rows(mesh, found) == rows(textured.cells, source)


def test_downloads_keep_textures_where_one_file_holds_them(textured, tmp_path):
    for format, is_kept in (("glb", True), ("obj", False)):
        name, content = export_bytes(textured, "regions", format)
        path = tmp_path / f"sent.{format}"
        path.write_bytes(content)
        assert (superfacets.read_attributes(path).texture is not None) == is_kept
        assert (b"mtllib" in content) is False
        assert name == f"wall.superfacets.{format}"
