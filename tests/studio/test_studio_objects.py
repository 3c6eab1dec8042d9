"""Objects of one class in the journal, in exports and in imports."""

import csv
import io
import json
import re
import zipfile
import zlib

import numpy as np
import pytest
import shapes

import superfacets
from superfacets import vertex_labels, write_mesh
from superfacets_studio.documents.agreement import agreement_text, folders_text, with_means
from superfacets_studio.documents.document import Document, merged_work, work_file_of
from superfacets_studio.documents.files import Files
from superfacets_studio.documents.journal import JournalError, _coded
from superfacets_studio.export.write import export_bytes, write_export
from superfacets_studio.labels.classes import default_classes, names_of
from superfacets_studio.labels.coding import base64_of
from superfacets_studio.labels.imports import read_import

CLASSES = [
    {"id": 1, "name": "chair"}, {"id": 2, "name": "table"},
    {"id": 3, "name": "wall", "stuff": True},
]  # fmt: skip
TIMES = ("time", "seconds", "strokes")  # entries that lines of old work files do not have


def reopened(document):
    document.close()
    return Document.open(document.path)


@pytest.fixture
def furnished(document):
    """Return two labeled chairs, a table, a wall, and a region of chairs without an object."""
    return furnish(document)


def furnish(document):
    document.set_classes(CLASSES)
    for region, number, place in ((3, 1, 1), (4, 1, 2), (5, 2, 1), (6, 3, 0), (7, 1, 0)):
        document.paint(document.revision.cells_of(region), number, objects=place)
    return document


def test_objects_come_back_after_a_restart_and_are_undone(furnished):
    paint = furnished.state.paint.copy()
    assert set(furnished.instances.tolist()) == {0, 1000, 1001, 1002, 2001, 3000}
    cells = furnished.revision.cells_of(3)
    furnished.paint(cells, [1] * len(cells), objects=np.arange(len(cells)) % 3)
    several = furnished.state.paint.copy()
    again = reopened(furnished)
    assert np.array_equal(again.state.paint, several)
    again.undo()
    assert np.array_equal(again.state.paint, paint)
    again.redo()
    assert np.array_equal(again.state.paint, several)
    again.close()


def test_a_work_file_of_the_first_version_opens(document):
    """Work files of the first version have classes, but no objects and no times."""
    document.paint(document.revision.cells_of(2), 4)
    document.paint(np.arange(3, dtype=np.uint32), [1, 2, 3])
    document.close()
    work = document.journal.path
    lines = [json.loads(line) for line in work.read_text().splitlines()]
    assert all("object" not in line and "objects" not in line for line in lines)
    lines = [{name: line[name] for name in line if name not in ("crc", *TIMES)} for line in lines]
    lines[0]["version"] = 1
    work.write_bytes(b"".join(map(_coded, lines)))
    again = Document.open(document.path)
    assert again.state.classes[:3].tolist() == [1, 2, 3]
    assert not again.state.objects.any()
    again.paint(np.array([7], np.uint32), 1, objects=9)
    again = reopened(again)
    assert again.instances[7] == 1009
    assert again.statistics == {}  # unknown, because the old lines have no times
    again.close()
    assert "statistics" not in Files.of(document.path, None, None, ()).listed()[0]


@pytest.mark.parametrize(
    ("entry", "reason"),
    [({"object": 1000}, "object must be 0 to 999, got 1000"),
     ({"object": "a"}, "object must be 0 to 999, got a"),
     ({"objects": "eA=="}, "damaged")],
)  # fmt: skip
def test_damaged_objects_in_a_work_file_are_told(document, entry, reason):
    line = {"seq": 1, "op": "paint", "cells": "", "class": 1, **entry, "done": 0.0}
    line["cells"] = base64_of(zlib.compress(b"\x05", level=1))
    document.close()
    with document.journal.path.open("ab") as file:
        file.write(_coded(line))
    with pytest.raises(ValueError, match=reason):
        Document.open(document.path)


def test_stuff_has_no_objects(furnished):
    wall = furnished.state.classes == 3
    furnished.paint(np.flatnonzero(wall).astype(np.uint32), 3, objects=4)
    assert set(furnished.instances[wall]) == {3000}
    furnished.set_classes([*CLASSES[:2], {"id": 3, "name": "wall"}])
    assert set(furnished.instances[wall]) == {3004}


def test_pieces_of_an_object_become_objects(furnished):
    apart = next(one for one in range(8, 20) if not _touch(furnished, one, 3))
    furnished.paint(furnished.revision.cells_of(apart), 1, objects=1)
    assert furnished.split_object(1, 1) == [3]
    sizes = [furnished.areas[furnished.instances == number].sum() for number in (1001, 1003)]
    assert sizes[0] >= sizes[1] > 0
    furnished.paint(furnished.revision.cells_of(apart), 1, objects=1)  # number 3 is free again
    assert furnished.split_object(1, 1) == [3]
    assert furnished.split_object(1, 0) == [4]  # cells without an object
    with pytest.raises(ValueError, match="chair 1 has only one piece"):
        furnished.split_object(1, 1)
    with pytest.raises(ValueError, match="there is no object 9 of class 1"):
        furnished.split_object(1, 9)
    for _ in range(4):
        furnished.undo()
    assert set(furnished.instances.tolist()) == {0, 1000, 1001, 1002, 2001, 3000}


def _touch(document, one, other):
    surface = document.segmenter.surface
    labels = document.revision.labels
    sources = np.repeat(np.arange(len(labels)), np.diff(surface.offsets))
    return (one, other) in set(zip(labels[sources], labels[surface.neighbors], strict=True))


def test_names_of_objects_are_kept_and_taken_away(client):
    client.done("paint", **{"class": 1}, object=2, cells=_coded_cells([1, 2]))
    client.done("name-object", **{"class": 1}, object=2, name=" by the door ")
    named = {"class": 1, "object": 2, "name": "by the door"}
    assert client.state()["object_names"] == [named]
    assert client.document().name_of(1, 2) == "by the door"
    assert client.done("undo")["object_names"] == []
    client.done("redo")
    document = reopened(client.document())
    assert list(document.state.object_names) == [named]
    document.close()


@pytest.mark.parametrize(("name", "body", "message"), [
    ("paint", {"class": 1, "object": 1000}, "object must be a whole number from 0 to 999"),
    ("paint", {"class": 1, "object": True}, "object must be a whole number from 0 to 999"),
    ("name-object", {"class": 1, "object": 5, "name": "a"}, "there is no object 5 of class 1"),
    ("name-object", {"class": 1, "object": 1, "name": 5}, "must be a string of valid Unicode"),
    ("split-object", {"class": 0, "object": 0}, "there is no object 0 of class 0"),
    ("review", {"reviewed": 1}, "reviewed must be True or False"),
    ("compare", {"files": [{"name": "a", "data": "eA=="}]}, "is not a work file"),
    ("compare", {"files": [{"name": str(i), "data": ""} for i in (1, 2)]},
     "a single work file"),
    ("accept", {"cells": "", "side": "mine"}, "there is nothing to compare with"),
    ("accept", {"cells": "", "side": "ours"}, "side must be one of mine, theirs"),
])  # fmt: skip
def test_wrong_requests_about_objects_say_what_is_wrong(client, name, body, message):
    client.done("paint", **{"class": 1}, object=1, cells=_coded_cells([1, 2]))
    answer = client.post(name, **({"cells": _coded_cells([3])} | body))
    assert 400 <= answer.status_code < 500
    assert message in answer.json()["error"]


def _coded_cells(numbers):
    return base64_of(np.array(numbers, np.uint32))


def test_a_review_is_marked_in_the_list_of_files(client):
    assert "reviewed" not in client.http.get("/api/files").json()[0]
    assert client.done("review", reviewed=True)["is_reviewed"]
    assert client.http.get("/api/files").json()[0]["reviewed"] is True
    client.close()
    assert client.http.get("/api/files").json()[0]["reviewed"] is True  # read from the work file


def test_changes_after_a_review_are_marked_until_it_is_reviewed_again(client):
    def listed():
        return client.http.get("/api/files").json()[0].get("changed_since_review", False)

    assert not client.done("paint", **{"class": 1}, cells=_coded_cells([1]))["is_changed"]
    assert not client.done("review", reviewed=True)["is_changed"]
    assert client.done("paint", **{"class": 1}, object=1, cells=_coded_cells([2]))["is_changed"]
    assert listed()
    client.close()
    assert listed()  # read from the work file
    assert not client.done("review", reviewed=True)["is_changed"]
    assert not listed()
    assert client.done("name-object", **{"class": 1}, object=1, name="a")["is_changed"]
    assert not client.done("review", reviewed=True)["is_changed"]
    assert client.done("undo")["is_changed"]  # back to a review without a name
    assert not client.done("redo")["is_changed"]
    assert not client.done("review", reviewed=False)["is_changed"]
    assert not client.done("paint", **{"class": 1}, cells=_coded_cells([3]))["is_changed"]


# Exports, each read back by independent code.


def test_instances_of_vertices_are_class_times_1000_plus_object(furnished):
    expected = vertex_labels(furnished.cells, furnished.instances, method="majority")
    path = write_export(furnished, "instances", "txt")
    assert path.name == "sheet.instances.txt"
    assert np.array_equal(np.loadtxt(path, dtype=int), np.maximum(expected, 0))
    assert np.array_equal(
        np.load(write_export(furnished, "instances", "npy")), np.maximum(expected, 0)
    )


def test_groups_are_objects_and_their_segments_are_in_one_object_each(furnished):
    furnished.paint(furnished.revision.cells_of(5)[::2], 1, objects=2)  # a region of two objects
    path = write_export(furnished, "objects", "aggregation.json")
    groups = json.loads(path.read_text())["segGroups"]
    assert [group["label"] for group in groups] == ["chair"] * 3 + ["table", "wall"]
    assert [group["objectId"] for group in groups] == list(range(5))
    joined = json.loads(path.read_text())["segmentsFile"]
    assert joined == "sheet.objects.segs.json"
    segments = json.loads(path.with_name(joined).read_text())["segIndices"]
    found = np.zeros(len(segments), int)
    for group, number in zip(groups, (1000, 1001, 1002, 2001, 3000), strict=True):
        found[np.isin(segments, group["segments"])] = number
    assert np.array_equal(found, np.load(write_export(furnished, "instances", "npy")))


def test_objects_are_written_as_coco_has_them_and_read_back_exactly(client):
    furnished = furnish(client.document())
    furnished.paint(furnished.revision.cells_of(9), 1, objects=7)  # numbers with a gap
    furnished.name_object(1, 2, "by the door")
    name, data = export_bytes(furnished, "objects", "json")
    assert name == "sheet.objects.json"
    content = json.loads(data)
    assert [one["isthing"] for one in content["categories"]] == [1, 1, 0]
    assert content["statistics"] == {"seconds": pytest.approx(0, abs=60), "strokes": 6}
    found = np.zeros(furnished.n_cells, int)
    for one in content["annotations"]:
        runs = one["segmentation"]["counts"]
        inside = np.repeat(np.arange(len(runs)) % 2, runs).astype(bool)
        found[inside] = one["category_id"] * 1000 + one["object"]
        assert one["area"] == pytest.approx(furnished.areas[inside].sum())
        assert one["n_cells"] == inside.sum()
        assert one["iscrowd"] == (one["category_id"] == 1 and one["object"] == 0)
    assert np.array_equal(found, furnished.instances)
    before = furnished.state.paint.copy()
    furnished.paint(np.arange(furnished.n_cells, dtype=np.uint32), 0)
    client.done("import", files=[{"name": name, "data": base64_of(data)}])
    assert np.array_equal(furnished.state.paint, before)
    assert furnished.state.object_names == ({"class": 1, "object": 2, "name": "by the door"},)
    client.done("undo")
    assert not furnished.state.paint.any()


def test_arrays_and_tables_have_class_and_object_of_each_cell(furnished):
    arrays = np.load(write_export(furnished, "objects", "npz"), allow_pickle=False)
    assert np.array_equal(arrays["class"] * 1000 + arrays["object"], furnished.instances)
    assert arrays["instances"].tolist() == [1000, 1001, 1002, 2001, 3000]
    assert arrays["names"].tolist() == ["chair", "chair 1", "chair 2", "table 1", "wall"]
    with write_export(furnished, "objects", "csv").open() as file:
        rows = list(csv.DictReader(file))
    instances = [int(row["class"]) * 1000 + int(row["object"]) for row in rows]
    assert instances == furnished.instances.tolist()


def test_each_object_is_a_mesh_of_its_own(furnished, tmp_path):
    _, data = export_bytes(furnished, "objects", "zip")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.namelist()[:3] == ["1000-chair.ply", "1001-chair-1.ply", "1002-chair-2.ply"]
        archive.extractall(tmp_path / "meshes")
    chair = superfacets.read_mesh(tmp_path / "meshes" / "1002-chair-2.ply")
    assert chair.n_faces == np.count_nonzero(furnished.instances == 1002)


@pytest.mark.parametrize("format", ["aggregation.json", "segs.json"])
def test_groups_are_downloaded_with_the_segments_that_they_name(furnished, format):
    name, data = export_bytes(furnished, "objects", format)
    assert name == "sheet.objects.scannet.zip"
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        groups = json.loads(archive.read("sheet.objects.aggregation.json"))
        segments = json.loads(archive.read(groups["segmentsFile"]))["segIndices"]
        assert len(archive.namelist()) == 2
    assert {one for group in groups["segGroups"] for one in group["segments"]} <= set(segments)


@pytest.mark.parametrize("format", ["json", "npz", "csv", "aggregation.json", "segs.json", "zip"])
def test_without_any_paint_there_are_no_objects(document, format):
    assert len(export_bytes(document, "objects", format)[1]) > 0


# Imports.


def test_each_group_of_scannet_is_an_object(client, sheet):
    ids = vertex_labels(superfacets.read_mesh(sheet), client.labels(), method="majority").tolist()
    groups = [
        {"segments": [0, 1], "label": "couch"}, {"segments": [2], "label": "couch"},
        {"segments": [3], "label": "wall"}, {"segments": [4], "label": "Class 2"},
        {"segments": [5], "label": "unknown"},
    ]  # fmt: skip
    client.done("paint", **{"class": 2}, object=3, cells=_coded_cells([0]))
    kept = client.labels()[0] not in (0, 1, 2, 3, 4)
    files = [
        _file("a.segs.json", {"segIndices": ids}),
        _file("a.aggregation.json", {"segGroups": groups}),
    ]  # fmt: skip
    client.done("import", files=files)
    labels, classes, objects = client.labels(), client.classes(), client.objects()
    number = next(entry["id"] for entry in client.state()["classes"] if entry["name"] == "couch")
    for region, place in ((0, 1), (1, 1), (2, 2)):
        assert ((classes == number) & (objects == place))[labels == region].mean() > 0.7
    assert client.state()["classes"][-1]["stuff"]
    assert set(np.unique(classes)) == {0, 2, number, number + 1}
    assert not objects[classes == number + 1].any()
    assert objects[(labels == 4) & (classes == 2)].min() == (4 if kept else 1)
    client.done("undo")
    assert np.flatnonzero(client.classes()).tolist() == [0]


def _file(name, content):
    data = json.dumps(content).encode()
    return {"name": name, "data": base64_of(data)}


@pytest.mark.parametrize(("content", "message"), [
    ({}, "the entry 'categories' is missing"),
    ({"categories": [], "annotations": [{}]}, "the entry 'segmentation' is missing"),
    (_one := {"categories": [{"id": 1, "name": "a"}], "annotations": [
        {"category_id": 1, "segmentation": {"counts": [1, 2]}}]},
     "an annotation has 3 cells, but the mesh has 2"),
    ({**_one, "annotations": [{"category_id": 2, "segmentation": {"counts": [1, 1]}}]},
     "the entry 2 is missing"),
    ({**_one, "annotations": 1000 * [{"category_id": 1, "segmentation": {"counts": [1, 1]}}]},
     "a has more than 999 objects"),
])  # fmt: skip
def test_damaged_files_of_objects_are_told(content, message):
    mesh = superfacets.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(superfacets.MeshError, match=f"a.objects.json: {message}"):
        read_import({"a.objects.json": json.dumps(content).encode()}, mesh, ())


# Comparison of two works.


@pytest.fixture
def two(tmp_path):
    """Return a mesh of 128 equal faces and two works on it: ``(mesh, mine, theirs)``."""
    path = tmp_path / "grid.ply"
    write_mesh(path, shapes.flat(8))
    works = []
    for name, chair, names in (("mine", 1, ["chair", "table"]), ("theirs", 2, ["table", "chair"])):
        work = tmp_path / f"{name}.studio.jsonl"
        classes = tuple(
            {"id": i, "name": one, "color": "#ff0000", "key": ""} for i, one in enumerate(names, 1)
        )
        document = Document.open(path, work, 8, classes)
        shift = 0 if name == "mine" else 8
        document.paint(_range(0 + shift, 32), chair, objects=1 + shift)
        document.paint(_range(32, 64), chair, objects=2)
        document.paint(_range(64, 80), 3 - chair, objects=1)
        document.paint(_range(96, 104) if shift else _range(80, 96), chair, objects=5)
        document.close()
        works.append(work)
    return path, *works


def _range(start, end):
    return np.arange(start, end, dtype=np.uint32)


def test_agreement_is_by_names_of_classes_and_by_overlap_of_objects(two):
    path, mine, theirs = two
    document = Document.open(path, mine)
    document.compare("theirs", theirs.read_bytes())
    found = document.agreement()
    chair = next(row for row in found["classes"] if row["name"] == "chair")
    # Faces 8 to 80 are labeled in both works. Faces labeled in only one do not affect the IoU.
    assert chair["iou"] == 1.0
    names = ("object", "mine", "theirs", "iou")
    assert [tuple(row[name] for name in names) for row in chair["objects"]] == [
        (1, 1, 9, 1.0),
        (2, 2, 2, 1.0),
        (5, 5, None, None),
        (6, None, 5, None),  # a new number
    ]
    assert found["share"] == 1.0
    assert found["labeled"] == pytest.approx(72 / 128)
    assert not len(document.differing())
    document.paint(_range(40, 48), 2, objects=1)
    assert document.differing().tolist() == list(range(40, 48))
    found = document.agreement()
    assert found["share"] == pytest.approx(64 / 72)
    ious = {row["name"]: row["iou"] for row in found["classes"]}
    assert ious == pytest.approx({"chair": 48 / 56, "table": 16 / 24}, abs=1e-6)
    document.accept(_range(40, 44), "mine")
    document.accept(_range(44, 50), "theirs")
    assert not len(document.differing())
    assert document.instances[[39, 40, 43, 44, 47]].tolist() == [1002, 2001, 2001, 1002, 1002]
    document.undo()
    assert document.instances[44] == 2001
    document.close()


def test_halves_of_my_object_are_two_objects_of_theirs(tmp_path):
    """The larger half becomes my object; the other, and an object of another class, are new."""
    path = tmp_path / "flat.ply"
    write_mesh(path, shapes.flat(8))
    theirs = Document.open(path, tmp_path / "theirs.studio.jsonl")
    theirs.paint(_range(0, 12), 1, objects=1)
    theirs.paint(_range(12, 32), 1, objects=2)
    theirs.paint(_range(32, 40), 2, objects=1)
    theirs.close()
    document = Document.open(path)
    document.paint(_range(0, 40), 1, objects=1)
    document.compare("theirs", (tmp_path / "theirs.studio.jsonl").read_bytes())
    document.accept(_range(0, 40), "theirs")
    assert document.instances[[0, 11, 12, 31, 32]].tolist() == [1002, 1002, 1001, 1001, 2001]
    document.close()


def test_works_that_nearly_agree_are_not_said_to_agree():
    wall = {"name": "wall", "iou": 0.9999, "objects": []}
    found = {"file": "a", "labeled": 1.0, "share": 0.9999, "classes": [wall]}
    shown = agreement_text(found) + folders_text([with_means("a", found)])
    assert re.findall(r"[01]\.\d+|\d+\.\d %", shown) == [
        "100.0 %", "99.9 %", "0.999", "100.0 %", "99.9 %", "0.999",
    ]  # fmt: skip


@pytest.mark.parametrize("prefer", ["mine", "theirs"])
def test_two_works_are_merged_by_the_command(two, tmp_path, prefer):
    from click.testing import CliRunner

    from superfacets_cli.studio import agree_command

    path, mine, theirs = two
    document = Document.open(path, mine)
    document.paint(_range(40, 48), 2, objects=1)
    document.close()
    target = tmp_path / "merged.studio.jsonl"
    arguments = [str(path), str(mine), str(theirs), "-o", str(target), "--prefer", prefer]
    result = CliRunner().invoke(agree_command, arguments)
    assert result.exit_code == 0, result.output
    assert result.output.startswith("both labeled 56.2 % of the area\n")
    assert result.output.splitlines()[1:-1] == [
        "both agree on 88.9 % of the area that both have labeled",
        "IoU there  class  object in MINE  object in THEIRS  object when merged",
        "0.857      chair", "1.000      chair  1               9                 1",
        "0.750      chair  2               2                 2",
        "-          chair  5               -                 5",
        "-          chair  -               5                 6", "0.667      table",
        "0.667      table  1               1                 1",
    ]  # fmt: skip
    merged = Document.open(path, target)
    assert merged.instances[[0, 10, 60, 70, 90, 100]].tolist() == [
        1001, 1001, 1002, 2001, 1005, 1006,
    ]  # fmt: skip
    assert merged.instances[40] == (2001 if prefer == "mine" else 1002)
    assert merged.instances[110] == 0
    merged.undo()
    assert merged.instances[100] == 0
    merged.close()
    assert isinstance(CliRunner().invoke(agree_command, arguments).exception, FileExistsError)


def test_shared_classes_of_two_folders_are_matched_by_name_and_keep_free_numbers(tmp_path):
    works = []
    for name, names in (("A", ["wall", "floor"]), ("B", ["floor", "wall", "door", "lamp"])):
        folder = tmp_path / name / "scans"
        folder.mkdir(parents=True)
        write_mesh(folder / "grid.ply", shapes.flat(8))
        files = Files.of(tmp_path / name, None, 8, default_classes(names))
        with files.document(0) as document:
            document.paint(_range(0, 64), 1 + names.index("floor"))
            document.paint(_range(64, 80), 4 if "lamp" in names else 0)
        files.close()
        works.append(work_file_of(folder / "grid.ply"))
    merged = tmp_path / "merged.studio.jsonl"
    found = merged_work(tmp_path / "A" / "scans" / "grid.ply", *works, merged)
    assert found["share"] == 1.0
    assert [row["name"] for row in found["classes"]] == ["floor", "lamp"]
    document = Document.read(tmp_path / "A" / "scans" / "grid.ply", merged)
    assert names_of(document.state.class_list) == {1: "wall", 2: "floor", 4: "lamp"}
    document.close()


def test_the_work_on_another_mesh_is_not_compared(two, document):
    with pytest.raises(
        ValueError,
        match=r"the work file belongs to grid\.ply, not to sheet\.ply: restore the old"
        r" file, or use another work file \(--work of superfacets studio\)",
    ):
        document.compare("mine", two[1].read_bytes())


@pytest.mark.parametrize("wrong", [1, 2])
def test_agree_names_the_work_file_on_another_mesh(two, sheet, tmp_path, wrong):
    other = tmp_path / "other.studio.jsonl"
    Document.open(sheet, other).close()
    paths = [*two]
    paths[wrong] = other
    with pytest.raises(JournalError, match=re.escape(f"{other}: the work file belongs to sheet")):
        merged_work(*paths)


def test_more_objects_than_fit_are_refused(two, limit):
    path, mine, theirs = two
    document = Document.open(path, mine)
    document.paint(_range(110, 112), 1, objects=999)
    with pytest.raises(
        ValueError, match="the two work files together have 1000 or more objects of a class"
    ):
        document.compare("theirs", theirs.read_bytes())
    limit("numbers of objects", 9)
    document.paint(np.arange(0, 128, 2, dtype=np.uint32), 1, objects=1)
    with pytest.raises(ValueError, match="a class has at most 9 objects"):
        document.split_object(1, 1)
    files = {"a.objects.json": json.dumps(_annotations(128, range(4))).encode()}
    seq = document.history.seq
    with pytest.raises(ValueError, match="a class has at most 9 objects"):
        document.apply_import(read_import(files, document.cells, document.class_list))
    assert document.history.seq == seq  # nor are classes added
    document.close()


def _annotations(n_cells, inside):
    runs = [inside[0], len(inside), n_cells - len(inside) - inside[0]]
    names = ("lamp", "chair")
    return {
        "categories": [{"id": number, "name": name} for number, name in enumerate(names)],
        "annotations": [{"category_id": i, "segmentation": {"counts": runs}} for i in range(2)],
    }
