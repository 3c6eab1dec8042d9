"""Objects that files suggest, accepted or rejected one by one."""

import base64
import json

import numpy as np
import pytest

pytest.importorskip("starlette", reason="Starlette is not installed")
pytest.importorskip("httpx", reason="httpx is not installed")

from studio_client import decoded, encoded, unpacked

from superfacets import Mesh, MeshError, read_mesh, write_mesh
from superfacets_studio.documents.document import Document
from superfacets_studio.documents.journal import JournalError
from superfacets_studio.labels.coding import unpack_cells
from superfacets_studio.labels.imports import read_import

SCORES = {10: 0.9, 11: 0.5, 12: 0.7, 13: None}
CLASSES = {10: "chair", 11: "class 2", 12: "object", 13: "wall"}


@pytest.fixture
def groups(tmp_path):
    """Write four suggestions: label 10 for cells 0 to 99, 11 for the next hundred, and so on."""
    labels = np.full(1152, -1, np.int32)
    labels[:400] = np.repeat([10, 11, 12, 13], 100)
    np.save(tmp_path / "lifted.npy", labels)
    entries = [{"segments": [one], "label": CLASSES[one], "score": SCORES[one]} for one in SCORES]
    return {
        "lifted.npy": (tmp_path / "lifted.npy").read_bytes(),
        "lifted.aggregation.json": json.dumps({"segGroups": entries}).encode(),
    }


@pytest.fixture
def suggested(document, groups):
    """Return a document with these suggestions."""
    assert document.suggest(read_import(groups, document.cells, document.class_list)) == 4
    return document


def ids_by_class(document):
    return {one.class_id: one.id for one in document.state.suggestions}


def reopened(document):
    """Return the same work, read from the disk."""
    document.close()
    return Document.open(document.path)


def class_named(document, name):
    return next(entry["id"] for entry in document.class_list if entry["name"] == name)


def test_suggestions_label_nothing_and_name_new_classes(suggested):
    assert not suggested.state.paint.any()
    chair, wall = class_named(suggested, "chair"), class_named(suggested, "wall")
    found = {one.class_id: one.score for one in suggested.state.suggestions}
    assert found == {chair: 0.9, 2: 0.5, 0: 0.7, wall: None}
    assert "object" not in [entry["name"] for entry in suggested.class_list]
    suggested.undo()
    assert suggested.state.suggestions == ()
    assert "chair" not in [entry["name"] for entry in suggested.class_list]


def test_an_accepted_suggestion_is_a_new_object_of_its_bare_cells(suggested):
    chair = class_named(suggested, "chair")
    suggested.paint(np.arange(50, dtype=np.uint32), 2, objects=1)
    suggested.paint(np.arange(900, 910, dtype=np.uint32), chair, objects=1)
    suggested.settle({ids_by_class(suggested)[chair]: chair})
    classes, objects = suggested.state.classes, suggested.state.objects
    assert (classes[:50] == 2).all()
    assert (classes[50:100] == chair).all()
    assert (objects[50:100] == 2).all()
    assert not classes[100:400].any()
    assert len(suggested.state.suggestions) == 3
    suggested.undo()
    assert not suggested.state.paint[50:100].any()
    assert len(suggested.state.suggestions) == 4


def test_several_are_accepted_in_one_step_each_as_an_object_but_of_stuff(suggested):
    ids, wall = ids_by_class(suggested), class_named(suggested, "wall")
    suggested.settle({ids[2]: 2, ids[0]: 2, ids[wall]: wall})
    objects, classes = suggested.state.objects, suggested.state.classes
    assert (classes[100:400] == np.repeat([2, 2, wall], 100)).all()
    assert sorted({*objects[100:200], *objects[200:300]}) == [1, 2]
    assert not objects[300:400].any()
    assert [one.score for one in suggested.state.suggestions] == [0.9]
    suggested.undo()
    assert not suggested.state.paint.any()


def test_a_suggestion_whose_cells_are_labeled_takes_no_object(suggested):
    ids = ids_by_class(suggested)
    suggested.paint(np.arange(100, 200, dtype=np.uint32), 3)
    suggested.settle({ids[2]: 2, ids[0]: 2})
    assert (suggested.state.classes[100:200] == 3).all()
    assert (suggested.state.objects[200:300] == 1).all()


def test_suggestions_survive_the_end_of_the_server_and_undo_goes_on(suggested):
    ids = ids_by_class(suggested)
    suggested.settle({ids[2]: 2}, [ids[0]])
    again = reopened(suggested)
    assert again.state.suggestions == suggested.state.suggestions
    assert np.array_equal(again.state.paint, suggested.state.paint)
    again.undo()
    again = reopened(again)
    assert len(again.state.suggestions) == 4
    again.redo()
    assert {one.score for one in again.state.suggestions} == {0.9, None}
    assert (again.state.classes[100:200] == 2).all()
    again.close()


def test_work_with_a_damaged_suggestion_is_refused(suggested):
    work = suggested.journal.path
    suggested.close()
    for damage, reason in (
        ({"score": 2}, "score must be 0 to 1, got 2"),
        ({"class": -1}, "class must be 0 to 65535, got -1"),
        ({"cells": ""}, "packed numbers are damaged"),
    ):
        lines = work.read_bytes().splitlines(keepends=True)
        line = json.loads(lines[-1])
        line["changes"][-1]["suggestions"][0] |= damage
        del line["crc"]
        from superfacets_studio.documents.journal import _coded

        work.write_bytes(b"".join([*lines[:-1], _coded(line)]))
        with pytest.raises(JournalError, match=f"line 2 of the work file is not valid: {reason}"):
            Document.open(suggested.path)
        work.write_bytes(b"".join(lines))


def test_what_cannot_be_settled_changes_nothing(suggested, document):
    ids = ids_by_class(suggested)
    state = suggested.state.suggestions
    for accepted, message in (
        ({99: 1}, "suggestion 99 does not exist"), ({ids[2]: 77}, "there is no class 77"),
        ({ids[0]: 0}, "needs a class"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            suggested.settle(accepted)
        assert suggested.state.suggestions == state
        assert not suggested.state.paint.any()
    with pytest.raises(ValueError, match=f"suggestion {ids[2]} is both accepted and rejected"):
        suggested.settle({ids[2]: 2}, [ids[2]])
    with pytest.raises(ValueError, match="no suggestion to accept or reject was given"):
        suggested.settle({})
    suggested.paint(np.arange(153, 1152, dtype=np.uint32), 2, objects=np.arange(1, 1000))
    with pytest.raises(ValueError, match="at most 999 objects"):
        suggested.settle({ids[2]: 2})


def test_a_class_with_suggestions_stays_in_the_list(suggested):
    chair = class_named(suggested, "chair")
    rest = [entry for entry in suggested.class_list if entry["id"] != chair]
    with pytest.raises(ValueError, match=f"class {chair} has suggestions: accept or reject them"):
        suggested.set_classes(rest)
    suggested.settle({}, [ids_by_class(suggested)[chair]])
    suggested.set_classes(rest)


def test_files_without_objects_and_with_wrong_scores(document, groups):
    with pytest.raises(ValueError, match="suggest no object"):
        document.suggest(read_import({"a.txt": b"0\n" * 1152}, document.cells, ()))
    for score in (1.5, -1, "high", True):
        entry = {"segments": [10], "label": "chair", "score": score}
        files = groups | {"lifted.aggregation.json": json.dumps({"segGroups": [entry]}).encode()}
        with pytest.raises(MeshError, match="score must be 0 to 1"):
            read_import(files, document.cells, ())


def strips(n):
    """Return a row of n triangles, each of which shares an edge with the next."""
    x = np.arange(n + 2.0)
    points = np.stack([x / 2, x % 2, 0 * x], axis=1)
    return Mesh(points, [[i, i + 1, i + 2] for i in range(n)])


def test_each_piece_of_a_class_is_suggested_but_stuff_is_one(tmp_path):
    """Two chairs (class 3) are not connected, and a wall (class 1) is in two pieces."""
    write_mesh(tmp_path / "row.ply", strips(12))
    classes = ({"id": 1, "name": "wall", "color": "#ff0000", "key": "", "stuff": True},)
    document = Document.open(tmp_path / "row.ply", None, 2, classes)
    files = {"row.txt": b"1 1 3 3 0 3 3 3 2 1 0 0".replace(b" ", b"\n")}
    assert document.suggest(read_import(files, document.cells, document.class_list)) == 4
    found = [
        (one.id, one.class_id, unpack_cells(one.cells, 12).tolist())
        for one in document.state.suggestions
    ]
    assert found == [(1, 1, [0, 1, 9]), (2, 2, [8]), (3, 3, [2, 3]), (4, 3, [5, 6, 7])]
    document.settle({number: class_id for number, class_id, _ in found})
    assert document.instances.tolist() == [
        *(1000, 1000, 3001, 3001, 0, 3002), *(3002, 3002, 2001, 1000, 0, 0)
    ]  # fmt: skip
    document.close()


def test_an_object_in_two_pieces_stays_one_suggestion(document, groups):
    labels = np.full(1152, -1, np.int32)
    labels[[0, 1, 2, 1149, 1150, 1151]] = 10
    files = groups | {"lifted.txt": "\n".join(map(str, labels)).encode()}
    del files["lifted.npy"]
    assert document.suggest(read_import(files, document.cells, document.class_list)) == 1


def test_groups_of_no_cells_suggest_nothing(document, groups):
    files = groups | {"lifted.aggregation.json": b'{"segGroups": []}'}
    with pytest.raises(ValueError, match="suggest no object"):
        document.suggest(read_import(files, document.cells, ()))


@pytest.mark.parametrize("text", [b"[]", b"null", b'{"segGroups": 5}', b'{"segGroups": [5]}'])
def test_json_of_another_shape_is_refused_in_plain_words(document, groups, text):
    with pytest.raises(MeshError, match="does not have the structure of this format"):
        read_import(groups | {"lifted.aggregation.json": text}, document.cells, ())


def test_exported_objects_are_suggestions_with_the_scores_that_were_added(document):
    runs = {"categories": [{"id": 3, "name": "lamp"}], "annotations": [
        {"category_id": 3, "object": n, "score": score, "iscrowd": crowd,
         "segmentation": {"counts": [start, 10, 1142 - start]}}
        for n, score, crowd, start in ((4, 0.25, 0, 0), (5, 0.75, 0, 20), (0, 0.5, 1, 40))
    ]}  # fmt: skip
    files = {"a.objects.json": json.dumps(runs).encode()}
    assert document.suggest(read_import(files, document.cells, document.class_list)) == 3
    assert [one.score for one in document.state.suggestions] == [0.5, 0.25, 0.75]


def test_the_page_gets_suggestions_and_the_effect_of_settling_them(client, groups):
    files = [{"name": n, "data": base64.b64encode(d).decode()} for n, d in groups.items()]
    reply = client.done("import", files=files, as_suggestions=True)
    assert (reply["suggested"], reply["n_suggestions"], reply["progress"]) == (4, 4, 0)
    header, arrays = unpacked(client.get("suggestions").content)
    entries = header["suggestions"]
    assert [entry["n_cells"] for entry in entries] == [100] * 4
    assert (np.bincount(arrays["owners"])[1:] == 100).all()
    two = next(place for place, entry in enumerate(entries) if entry["class"] == 2)
    client.done("paint", **{"class": 1}, cells=encoded(range(100, 110)))
    done = client.done("settle", accept=[[entries[two]["id"], 2]])
    assert (done["kind"], done["n_suggestions"]) == ("settle", 3)
    assert decoded(done["cells"]).tolist() == list(range(110, 200))
    assert set(decoded(done["paint"])) == {2 | 1 << 16}
    undone = client.done("undo")
    assert (undone["kind"], undone["n_suggestions"]) == ("settle", 4)
    assert client.post("import", files=files, as_suggestions="yes").status_code == 400


def test_lifted_objects_come_with_their_scores(tmp_path, sheet, document):
    mesh = read_mesh(sheet)
    labels = np.full(mesh.n_faces, -1)
    labels[:20] = np.repeat([0, 1], 10)
    write_mesh(
        tmp_path / "o.aggregation.json", mesh, labels, classes=["object"] * 2, scores=[1, 0.125]
    )
    np.save(tmp_path / "o.npy", labels)
    files = {name: (tmp_path / name).read_bytes() for name in ("o.npy", "o.aggregation.json")}
    document.suggest(read_import(files, document.cells, document.class_list))
    assert [(one.class_id, one.score) for one in document.state.suggestions] == [(0, 1), (0, 0.125)]
    for scores, error in (
        ([1], r"scores must have one value per region \(2\), got 1 value"),
        ([2, 0], r"scores must be a list of numbers in \[0, 1\], got \[2, 0\]"),
    ):
        with pytest.raises(ValueError, match=error):
            write_mesh(tmp_path / "o.aggregation.json", mesh, labels, scores=scores)
    with pytest.raises(
        ValueError, match=r"scores needs an output with the ending \.aggregation\.json"
    ):
        write_mesh(tmp_path / "o.ply", mesh, labels, scores=[1, 1])
